"""What vLLM calls in its own processes: a plugin, and the maker of its cache of encoded frames.

The plugin loads checkpoints of new transformers. See `hf.tower_names` for the two forms; vLLM 0.32
reads one of them alone. It also lets processors forget by what they were loaded: vLLM counts the
tokens of an image with these arguments, too, and transformers keeps what it counted with among the
defaults of the processor's calls, which then refuse it.
"""

import functools
import importlib
import os
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from model_adapters.hf.loading.tower_names import published_name

# Set by our engine. Whatever else uses vLLM in this environment keeps vLLM as it is.
ACTIVE = "INFTHOR_EVAL_VLLM_PLUGIN"
_MODELS = {
    "cohere2_vision": "Cohere2VisionForConditionalGeneration",
    "gemma3_mm": "Gemma3ForConditionalGeneration",
    "llava": "LlavaForConditionalGeneration",
    "llava_next": "LlavaNextForConditionalGeneration",
    "llava_onevision": "LlavaOnevisionForConditionalGeneration",
    "qwen3_vl_moe": "Qwen3VLMoeForConditionalGeneration",
}
# The axis of the hidden size in the experts' weights as published; transformers exchanges the last
# two when it reads them, and saves them as it has them.
_HIDDEN_AXES = {"mlp.experts.gate_up_proj": 1, "mlp.experts.down_proj": 2}
_LOADED_BY = "use_fast"
_TOKENS = "tokens"
_Weights = Iterable[tuple[str, Any]]


def register() -> None:
    """Let vLLM's models take both's forms; vLLM calls it (entry point `vllm.general_plugins`)."""
    if os.environ.get(ACTIVE) != "1":
        return
    for module, name in _MODELS.items():
        model = getattr(importlib.import_module(f"vllm.model_executor.models.{module}"), name)
        if not hasattr(model.load_weights, "__wrapped__"):
            model.load_weights = _taking_both(model.load_weights)
    processor = importlib.import_module("transformers.processing_utils").ProcessorMixin
    if not hasattr(processor._merge_kwargs, "__wrapped__"):
        processor._merge_kwargs = _forgetting(processor._merge_kwargs)


def _forgetting(merge: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(merge)
    def merged(processor: Any, of_call: Any, *args: Any, **kwargs: Any) -> Any:
        for defaults in getattr(of_call, "_defaults", {}).values():
            defaults.pop(_LOADED_BY, None)
        return merge(processor, of_call, *args, **kwargs)

    return merged


def _taking_both(load_weights: Callable[[Any, _Weights], Any]) -> Callable[[Any, _Weights], Any]:
    @functools.wraps(load_weights)
    def load(model: Any, weights: _Weights) -> Any:
        if hasattr(getattr(model, "vision_tower", None), "vision_model"):
            weights = _with_level(weights)
        return load_weights(model, _with_axes(weights, model.config.get_text_config().hidden_size))

    return load


def _with_level(weights: _Weights) -> Iterator[tuple[str, Any]]:
    for name, tensor in weights:
        yield published_name(name), tensor


def _with_axes(weights: _Weights, hidden_size: int) -> Iterator[tuple[str, Any]]:
    for name, tensor in weights:
        axis = next((axis for end, axis in _HIDDEN_AXES.items() if name.endswith(end)), None)
        is_exchanged = axis is not None and tensor.shape[axis] != hidden_size
        yield name, tensor.transpose(1, 2) if is_exchanged else tensor


class EncoderCacheMaker:
    """Makes vLLM's own cache of encoded frames, of a size that vLLM has no argument for."""

    @classmethod
    def create_manager(cls, *, cache_size: int, vllm_config: Any) -> Any:
        """Return the cache with room for the tokens of `encoder_cache_of`, or for vLLM's own choice
        if that is more."""
        module = importlib.import_module("vllm.v1.core.encoder_cache_manager")
        asked = vllm_config.ec_manager_config.manager_config[_TOKENS]
        return module.EncoderCacheManager(cache_size=max(cache_size, asked))


def encoder_cache_of(n_tokens: int) -> dict[str, Any]:
    """Return vLLM's `ec_manager_config` for a cache of encoded frames of so many tokens."""
    maker = f"{EncoderCacheMaker.__module__}.{EncoderCacheMaker.__qualname__}"
    return {"encoder_cache_manager_cls": maker, "manager_config": {_TOKENS: n_tokens}}
