"""From our options and a checkpoint's config to the arguments of `vllm.LLM`. Nothing here imports vLLM."""

from pathlib import Path
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.options.checkpoints import parse_rope
from model_adapters.vllm.options import EngineOptions, VllmOptions

__all__ = ["engine_arguments", "frame_limit", "model_arguments", "rope_overrides", "token_limit"]

# Whose extended length vLLM reads off max_position_embeddings; the length of the others it multiplies by the factor.
_LENGTH_IN_CONFIG = ("yarn", "longrope")
_NO_VIDEO = 0  # else vLLM reserves memory for the longest video that the model could be shown


def engine_arguments(folder: Path, options: EngineOptions) -> dict[str, Any]:
    """What every model is started with.

    Args:
        folder: the checkpoint's: vLLM reads the files that were found here, so that both engines run the same ones.
        options: as typed; what is None is left to vLLM.
    """
    chosen = {
        "max_model_len": options.max_model_len,
        "distributed_executor_backend": options.distributed_executor_backend,
        "quantization": options.quantization,
        "mm_processor_cache_gb": options.mm_processor_cache_gb,
    }
    return {
        "model": str(folder),
        "dtype": options.dtype,
        "seed": options.seed,
        "tensor_parallel_size": options.tensor_parallel_size,
        "pipeline_parallel_size": options.pipeline_parallel_size,
        "data_parallel_size": options.data_parallel_size,
        "gpu_memory_utilization": options.gpu_memory_utilization,
        "enforce_eager": options.enforce_eager,
        "enable_prefix_caching": options.prefix_caching,
        **{name: value for name, value in chosen.items() if value is not None},
    }


def model_arguments(
    folder: Path, config: Any, options: VllmOptions, *, max_tokens: int, max_frames: int
) -> dict[str, Any]:
    """What a model that can be talked to is started with.

    Args:
        folder: the checkpoint's.
        config: its config, with the extension of the context written into it.
        options: as typed.
        max_tokens: most tokens of context and reply together.
        max_frames: most frames of a request.

    Raises:
        ModelError: vLLM has no such extension for this model.
    """
    frames = {"count": max_frames, "width": options.frame_size, "height": options.frame_size}
    arguments = engine_arguments(folder, options) | {
        "max_model_len": max_tokens,
        "trust_remote_code": options.trust_remote_code,
        "limit_mm_per_prompt": {"image": frames, "video": _NO_VIDEO},
    }
    if options.rope is not None:
        arguments["hf_overrides"] = rope_overrides(config, options.rope)
    if options.image_settings():
        arguments["mm_processor_kwargs"] = options.image_settings()
    return arguments


def token_limit(pretrained: str, limit: int | None, options: VllmOptions) -> int:
    """Most tokens of context and reply together.

    Args:
        pretrained: the checkpoint, for the message.
        limit: its own, extended; None where its config names none.
        options: as typed.

    Raises:
        ModelError: there is none.
    """
    chosen = options.max_model_len or limit
    if chosen is None:
        raise ModelError(f"the config of {pretrained} names no longest context; give max_model_len=")
    return chosen


def frame_limit(max_tokens: int, tokens_per_frame: int, options: VllmOptions) -> int:
    """Most frames of a request: what was asked for, else as many as fit."""
    return options.max_frames or max(1, max_tokens // tokens_per_frame)


def rope_overrides(config: Any, rope: str) -> dict[str, Any]:
    """The extension of a context as vLLM takes it: in the language model's own config, whole.

    Args:
        config: the model's, into which `apply_rope` has written the extension.
        rope: `TYPE:FACTOR`.

    Raises:
        ModelError: vLLM would drop the model's positions of three axes, and say nothing.
    """
    rope_type, factor = parse_rope(rope)
    text = config.get_text_config()
    if "mrope_section" in text.rope_parameters and rope_type != "yarn":
        raise ModelError(
            f"rope={rope}: of {config.model_type}, whose positions have three axes, vLLM extends the context by "
            f"yarn alone; use yarn:{factor:g}"
        )
    changed: dict[str, Any] = {"rope_parameters": dict(text.rope_parameters)}
    if rope_type in _LENGTH_IN_CONFIG:
        changed["max_position_embeddings"] = int(text.max_position_embeddings * factor)
    nested = next((name for name in config.sub_configs if getattr(config, name, None) is text), None)
    return changed if nested is None else {nested: changed}
