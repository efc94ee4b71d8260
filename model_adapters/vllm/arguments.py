"""Arguments of `vllm.LLM` from our options and a checkpoint's config. Nothing here imports vLLM."""

from pathlib import Path
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.options.checkpoints import parse_rope
from model_adapters.vllm.options import EngineOptions, VllmOptions
from model_adapters.vllm.plugin import encoder_cache_of

# vLLM reads the extended length of these from max_position_embeddings; for others it multiplies by
# the factor itself.
_LENGTH_IN_CONFIG = ("yarn", "longrope", "longrope-scaled")
# vLLM multiplies the original length of these by a factor before it places YaRN's ramp;
# transformers does not.
_FOURFOLD = {"qwen2_vl": 4, "qwen2_5_vl": 4}
# Llama 4's; vLLM leaves it out of contexts up to 32,768 tokens, whatever the config says.
_TUNING = "attn_temperature_tuning"
_NO_VIDEO = 0  # otherwise vLLM reserves memory for the longest possible video


def engine_arguments(folder: Path, options: EngineOptions) -> dict[str, Any]:
    """Return the arguments of every model; the choice is vLLM's where an option is None.

    The checkpoint's folder is found or downloaded here, so that both engines run the same files.
    """
    optional = {
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
        **{name: value for name, value in optional.items() if value is not None},
        **options.throughput(),
    }


def model_arguments(
    folder: Path, config: Any, options: VllmOptions, *, max_tokens: int, max_frames: int
) -> dict[str, Any]:
    """Return the arguments of a model that answers in conversations.

    A context extension is in the config already. `max_tokens` limits context and reply together;
    `max_frames` is 0 for a model that reads text alone.
    """
    arguments = engine_arguments(folder, options) | {
        "max_model_len": max_tokens,
        "trust_remote_code": options.trust_remote_code,
    }
    if max_frames:
        arguments |= _frame_arguments(options, max_frames)
    if options.encoder_cache_tokens is not None:
        arguments["ec_manager_config"] = encoder_cache_of(options.encoder_cache_tokens)
    if options.rope is not None:
        arguments["hf_overrides"] = rope_overrides(config, options.rope)
    tuning = getattr(config.get_text_config(), _TUNING, None)
    if tuning is not None:
        arguments["override_generation_config"] = {_TUNING: bool(tuning)}
    return arguments


def _frame_arguments(options: VllmOptions, max_frames: int) -> dict[str, Any]:
    frames = {"count": max_frames, "width": options.frame_size, "height": options.frame_size}
    return {
        "limit_mm_per_prompt": {"image": frames, "video": _NO_VIDEO},
        "mm_processor_kwargs": {
            "use_fast": options.image_backend == "torchvision",
            **options.image_settings(),
        },
    }


def token_limit(pretrained: str, limit: int | None, options: VllmOptions) -> int:
    """Return the most tokens of context and reply together: the options' or the checkpoint's limit,
    which is extended.
    """
    n_tokens = options.max_model_len or limit
    if n_tokens is None:
        raise ModelError(f"the config of {pretrained} has no context limit; give max_model_len=")
    return n_tokens


def frame_limit(max_tokens: int, tokens_per_frame: int, options: VllmOptions) -> int:
    """Return the most frames of a request: that of the options, else as many as fit."""
    return options.max_frames or max(1, max_tokens // tokens_per_frame)


def rope_overrides(config: Any, rope: str) -> dict[str, Any]:
    """Return a context extension `TYPE:FACTOR` as overrides of the config, in vLLM's form.

    vLLM replaces `rope_parameters` as a whole, so all of them are given, as `apply_rope` has
    written them.
    """
    rope_type, factor = parse_rope(rope)
    text = config.get_text_config()
    has_axes = "mrope_section" in text.rope_parameters
    _check_extension(config.model_type, rope_type, factor, has_axes=has_axes)
    overrides: dict[str, Any] = {"rope_parameters": dict(text.rope_parameters)}
    if has_axes:
        overrides["rope_parameters"]["original_max_position_embeddings"] //= _FOURFOLD[
            config.model_type
        ]
    if rope_type == "longrope":
        # vLLM ignores `factor` here, and scales attention by the ratio of the two lengths unless it
        # is told a scale.
        overrides["rope_parameters"] |= {"short_mscale": 1.0, "long_mscale": 1.0}
    if rope_type in _LENGTH_IN_CONFIG:
        overrides["max_position_embeddings"] = int(text.max_position_embeddings * factor)
    nested = next(
        (name for name in config.sub_configs if getattr(config, name, None) is text), None
    )
    return overrides if nested is None else {nested: overrides}


def _check_extension(model_type: str, rope_type: str, factor: float, *, has_axes: bool) -> None:
    yarn = f"use yarn:{factor:g}, or --engine transformers"
    if rope_type == "dynamic":
        raise ModelError(
            f"rope={rope_type}:{factor:g}: vLLM has angles up to the original length alone, and "
            f"answers nonsense beyond; {yarn}"
        )
    if has_axes and rope_type != "yarn":
        raise ModelError(
            f"rope={rope_type}:{factor:g}: for {model_type}, which has three-axis positions, vLLM "
            f"supports only yarn; {yarn}"
        )
    if has_axes and model_type not in _FOURFOLD:
        raise ModelError(
            f"rope={rope_type}:{factor:g}: of {model_type}, which has three-axis positions, it is "
            "not known whether vLLM extends it as transformers does; use --engine transformers"
        )
