"""Adapters of the families of `hf/` with their weights in vLLM."""

from typing import Any, ClassVar

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.hf_lm import HfLm, TextFamily
from model_adapters.hf.families.hf_vlm import HfVlm, find_family
from model_adapters.hf.families.llava_onevision import LlavaOnevision
from model_adapters.hf.families.load_check import require_same_ids
from model_adapters.hf.families.pixtral import Pixtral
from model_adapters.hf.families.qwen2_5_vl import Qwen25VL
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.limits import wrap_model_errors
from model_adapters.hf.loading.checkpoint import (
    LocatedCheckpoint,
    build_meta_model,
    read_checkpoint,
)
from model_adapters.vllm.arguments import frame_limit, model_arguments, token_limit
from model_adapters.vllm.cpu import check_kernels, runs_on_cpu
from model_adapters.vllm.engine import Engine, import_vllm, require_version
from model_adapters.vllm.model import VllmModel
from model_adapters.vllm.options import PixelVllmOptions, VllmOptions


class _FamilyOnVllm:
    """Base of the adapters of one family, each with the adapter of the family in transformers."""

    Options: ClassVar[type] = VllmOptions
    hf_adapter: ClassVar[type[CheckpointAdapter]]

    @classmethod
    def build(cls, name: str, options: VllmOptions, seed: int) -> VllmModel:  # noqa: ARG003
        """Start vLLM with a checkpoint; the seed is not used."""
        import_vllm(name)  # fails before gigabytes are downloaded
        return _start(name, cls.hf_adapter.locate(options), cls.hf_adapter.family)


class Qwen25VLOnVllm(_FamilyOnVllm):
    """The adapter `qwen2.5-vl@vllm`."""

    Options = PixelVllmOptions
    hf_adapter = Qwen25VL


class LlavaOnevisionOnVllm(_FamilyOnVllm):
    """The adapter `llava-onevision@vllm`."""

    hf_adapter = LlavaOnevision


class PixtralOnVllm(_FamilyOnVllm):
    """The adapter `pixtral@vllm`."""

    hf_adapter = Pixtral


class HfVlmOnVllm:
    """The adapter `hf-vlm@vllm`."""

    Options: ClassVar[type] = VllmOptions

    @classmethod
    def build(cls, name: str, options: VllmOptions, seed: int) -> VllmModel:  # noqa: ARG003
        """Start vLLM with any checkpoint that it supports."""
        import_vllm(name)
        located = HfVlm.locate(name, options)
        return _start(name, located, *find_family(located))


class HfLmOnVllm:
    """The adapter `hf-lm@vllm`."""

    Options: ClassVar[type] = VllmOptions

    @classmethod
    def build(cls, name: str, options: VllmOptions, seed: int) -> VllmModel:  # noqa: ARG003
        """Start vLLM with a language model; the seed is not used."""
        import_vllm(name)
        return _start(name, HfLm.locate(name, options), TextFamily)


def _start(
    name: str, located: LocatedCheckpoint[Any], family: MakeFamily, processor: Any = None
) -> VllmModel:
    options: VllmOptions = located.options
    if options.encoder_cache_tokens is not None:
        require_version(name, "0.33", "encoder_cache_tokens")
    loaded = read_checkpoint(located, family, build_meta_model)
    if processor is not None:
        hint = f"{located.config.model_type} cannot be run in vLLM; use --engine transformers"
        require_same_ids(loaded, processor, options.pretrained, hint)
    if runs_on_cpu():
        check_kernels(name, located.config)
    max_tokens = token_limit(options.pretrained, loaded.max_tokens, options)
    max_frames = 0
    if located.has_vision:
        with wrap_model_errors(name):
            per_frame = len(loaded.family.frame_ids((options.frame_size, options.frame_size)))
        max_frames = frame_limit(max_tokens, per_frame, options)
    arguments = model_arguments(
        located.folder, located.config, options, max_tokens=max_tokens, max_frames=max_frames
    )
    engine = Engine(name, arguments, options.threads)
    return VllmModel(name, loaded, engine, options, max_tokens=max_tokens, max_frames=max_frames)
