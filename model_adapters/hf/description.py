"""Capabilities and identity of a checkpoint that transformers runs."""

from typing import Any

from model_adapters.hf.loaded import LoadedCheckpoint
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import Capabilities

__all__ = ["capabilities", "identity"]


def capabilities(loaded: LoadedCheckpoint, options: HfOptions, batch_size: int) -> Capabilities:
    """Return the capabilities of a checkpoint under these options.

    Args:
        loaded: the checkpoint.
        options: inference options.
        batch_size: continuations that are answered together.
    """
    text_config = loaded.model.config.get_text_config()
    return Capabilities(
        sampling=True,
        choices=True,
        batch_size=batch_size,
        max_tokens=_context_limit(loaded, options),
        max_tokens_before_extension=None if options.rope is None else text_config.max_position_embeddings,
    )


def identity(name: str, loaded: LoadedCheckpoint, options: HfOptions) -> dict[str, Any]:
    """Return what distinguishes this model under these options from others, as JSON values."""
    generation = loaded.generation
    return loaded.identity | {
        "adapter": name,
        "max_tokens": _context_limit(loaded, options),
        "prompt": options.prompt,
        "share_prefix": options.share_prefix,
        "chunk_tokens": options.chunk_tokens,
        "batch_size": options.batch_size,
        "generation": {
            "repetition_penalty": generation.repetition_penalty,
            "end_ids": sorted(generation.end_ids),
        },
    }


def _context_limit(loaded: LoadedCheckpoint, options: HfOptions) -> int | None:
    """Return the context limit of the options, else of the checkpoint, or None."""
    return (loaded.max_tokens if options.max_tokens is None else options.max_tokens) or None
