"""Any transformers model as a `Model`: conversations over one encoded prefix."""

from collections.abc import Sequence
from typing import Any

import torch

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.engine.decoding import cut_at_stop, generate
from model_adapters.engine.features import FeatureCache
from model_adapters.engine.loaded import Loaded
from model_adapters.engine.options import EngineOptions
from model_adapters.engine.prefix import Prefix
from model_adapters.engine.prompt import Frame, Prompter, Unit, n_tokens, token_ids
from model_adapters.protocols import Part, Reply
from model_adapters.transcript import Transcript

__all__ = ["TransformersConversation", "TransformersModel"]


class TransformersModel:
    """A loaded checkpoint behind the `Model` protocol.

    All conversations of a model share one encoded sequence: a reply keeps what its prompt has in common with the last
    one's, whichever conversation that was, so that conversations over the same frames share them too.

    Args:
        name: the registry's name.
        loaded: the checkpoint.
        options: how to run it.
    """

    def __init__(self, name: str, loaded: Loaded, options: EngineOptions) -> None:
        self.name = name
        self._loaded = loaded
        self._options = options
        keep = options.feature_cache_mb * 2**20 if options.share_prefix else 0
        features = FeatureCache(loaded.family, keep)
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
        self._prefix = Prefix(loaded.model, loaded.family, features, options.chunk_tokens)
        self._features = features

    @property
    def max_tokens(self) -> int | None:
        """The checkpoint's context limit, or the option's."""
        limit = self._loaded.max_tokens if self._options.max_tokens is None else self._options.max_tokens
        return limit or None

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, kernels, versions and generation settings, as JSON values."""
        generation = self._loaded.generation
        return self._loaded.identity | {
            "adapter": self.name,
            "max_tokens": self.max_tokens,
            "share_prefix": self._options.share_prefix,
            "chunk_tokens": self._options.chunk_tokens,
            "generation": {
                "do_sample": False,
                "repetition_penalty": generation.repetition_penalty,
                "end_ids": sorted(generation.end_ids),
            },
        }

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        return next(len(unit.ids) for unit in self.units([frame]) if isinstance(unit, Frame))

    def conversation(self) -> "TransformersConversation":
        """A new, empty conversation."""
        return TransformersConversation(self)

    def close(self) -> None:
        """Free the KV cache, the features and the weights."""
        self._prefix.reset()
        self._features.clear()
        del self._prefix, self._features, self._prompter, self._loaded
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    def units(self, parts: Sequence[Part]) -> list[Unit]:
        """What a reply to these parts would be made from."""
        return self._prompter.units(parts)

    def reply(self, parts: Sequence[Part], max_new_tokens: int, stop: Sequence[str]) -> Reply:
        """Answer one user turn; see `Conversation.reply`."""
        units = self.units(parts)
        n_context = n_tokens(units)
        self._check_limit(n_context, max_new_tokens)
        if not self._options.share_prefix:
            self._prefix.reset()
        try:
            return self._reply(units, n_context, max_new_tokens, stop)
        except (RuntimeError, MemoryError) as error:
            if not _is_out_of_memory(error):
                raise
            self._prefix.reset()
            self._features.clear()
            raise ModelError(f"out of memory on a context of {n_context} tokens ({self.name})") from error

    def _reply(self, units: list[Unit], n_context: int, max_new_tokens: int, stop: Sequence[str]) -> Reply:
        shared = self._prefix.rewind_to(units)
        cached = self._prefix.n_tokens
        logits = self._prefix.feed(units[shared:], reserve=max_new_tokens)
        ids = generate(
            logits,
            lambda token: self._prefix.feed([token]),
            context=token_ids(units),
            settings=self._loaded.generation,
            max_new_tokens=max_new_tokens,
            finished=lambda ids: cut_at_stop(self._decode(ids), stop) is not None if stop else False,
        )
        self._prefix.cut(len(units))
        text = self._decode(ids)
        before_stop = cut_at_stop(text, stop)
        return Reply(text if before_stop is None else before_stop, tuple(ids), n_context, cached)

    def _decode(self, ids: list[int]) -> str:
        return self._loaded.tokenizer.decode(ids, skip_special_tokens=True)

    def _check_limit(self, n_context: int, max_new_tokens: int) -> None:
        limit = self.max_tokens
        if limit is not None and n_context + max_new_tokens > limit:
            raise ModelError(
                f"a context of {n_context} tokens and {max_new_tokens} new ones is beyond the {limit} tokens "
                f"of {self.name}; use fewer frames, or set max_tokens if the model can take more"
            )


def _is_out_of_memory(error: Exception) -> bool:
    # torch has an exception of its own for GPUs only; on CPU the allocator's name in the message tells.
    return isinstance(error, torch.OutOfMemoryError | MemoryError) or "DefaultCPUAllocator" in str(error)


class TransformersConversation(Transcript):
    """A conversation with a `TransformersModel`."""

    def __init__(self, model: TransformersModel) -> None:
        super().__init__()
        self._model = model

    @property
    def n_tokens(self) -> int:
        """Tokens that `reply` would give the model now."""
        return n_tokens(self._model.units(self.parts))

    def reply(self, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
        """Answer greedily; see `Conversation.reply`."""
        if max_new_tokens < 1:
            raise ValueError(f"max_new_tokens must be at least 1, not {max_new_tokens}")
        return self._model.reply(self.parts, max_new_tokens, stop)
