"""Adapters of the checkpoints that vLLM runs: the families of `hf/`, their weights in vLLM."""

import functools
from typing import Any, ClassVar

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.checkpoint import LocatedCheckpoint, outline, read_checkpoint
from model_adapters.hf.families.hf_vlm import HfVlm, ProcessorFamily, known_family, load_processor
from model_adapters.hf.families.llava_onevision import LlavaOnevision
from model_adapters.hf.families.pixtral import Pixtral
from model_adapters.hf.families.qwen2_5_vl import Qwen25VL
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.limits import naming_model_errors
from model_adapters.vllm.arguments import frame_limit, model_arguments, token_limit
from model_adapters.vllm.engine import Engine, import_vllm
from model_adapters.vllm.model import VllmModel
from model_adapters.vllm.options import (
    HfVlmOnVllmOptions,
    LlavaOnevisionOnVllmOptions,
    PixtralOnVllmOptions,
    Qwen25VLOnVllmOptions,
    VllmOptions,
)

__all__ = ["HfVlmOnVllm", "LlavaOnevisionOnVllm", "PixtralOnVllm", "Qwen25VLOnVllm"]


class _FamilyOnVllm:
    """Base of adapters of one family.

    Attributes:
        Options: the family's options.
        runs: the same family's adapter in transformers.
    """

    Options: ClassVar[type] = VllmOptions
    runs: ClassVar[type[CheckpointAdapter]]

    @classmethod
    def build(cls, name: str, options: VllmOptions, seed: int) -> VllmModel:  # noqa: ARG003
        """Start vLLM with a checkpoint; nothing in it is random.

        Raises:
            ModelError: vLLM is not there, or the checkpoint cannot be read or run.
        """
        import_vllm(name)  # told before gigabytes are fetched
        return _start(name, cls.runs.locate(options), cls.runs.family)


class Qwen25VLOnVllm(_FamilyOnVllm):
    """The adapter `qwen2.5-vl@vllm`."""

    Options = Qwen25VLOnVllmOptions
    runs = Qwen25VL


class LlavaOnevisionOnVllm(_FamilyOnVllm):
    """The adapter `llava-onevision@vllm`."""

    Options = LlavaOnevisionOnVllmOptions
    runs = LlavaOnevision


class PixtralOnVllm(_FamilyOnVllm):
    """The adapter `pixtral@vllm`."""

    Options = PixtralOnVllmOptions
    runs = Pixtral


class HfVlmOnVllm:
    """The adapter `hf-vlm@vllm`."""

    Options: ClassVar[type] = HfVlmOnVllmOptions

    @classmethod
    def build(cls, name: str, options: HfVlmOnVllmOptions, seed: int) -> VllmModel:  # noqa: ARG003
        """Start vLLM with any checkpoint that it knows.

        Raises:
            UsageError: no checkpoint was named.
            ModelError: vLLM is not there, or the checkpoint cannot be read or run.
        """
        import_vllm(name)
        located = HfVlm.locate(name, options)
        known = known_family(located.config)
        if known is None:
            known = functools.partial(ProcessorFamily, processor=load_processor(located))
        return _start(name, located, known)


def _start(name: str, located: LocatedCheckpoint[Any], family: MakeFamily) -> VllmModel:
    options: VllmOptions = located.options
    loaded = read_checkpoint(located, family, outline)
    max_tokens = token_limit(options.pretrained, loaded.max_tokens, options)
    with naming_model_errors(name):
        per_frame = len(loaded.family.frame_ids((options.frame_size, options.frame_size)))
    max_frames = frame_limit(max_tokens, per_frame, options)
    arguments = model_arguments(located.folder, located.config, options, max_tokens=max_tokens, max_frames=max_frames)
    return VllmModel(name, loaded, Engine(name, arguments), options, max_tokens=max_tokens, max_frames=max_frames)
