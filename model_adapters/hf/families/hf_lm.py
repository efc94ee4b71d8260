"""Any model of `AutoModelForCausalLM`, which reads text alone.

As with `hf-vlm`, samples show when it is loaded that it is run as its own code does it
(`load_check`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar, TypeVar

import torch
from transformers.models.auto.modeling_auto import (
    MODEL_FOR_CAUSAL_LM_MAPPING_NAMES,
    MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES,
)

from infthor_eval.errors import ModelError, UsageError
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.families.load_check import check_text
from model_adapters.hf.families.plain import PlainFamily, three_axis_positions
from model_adapters.hf.family import NO_TOKEN, Pixels, Shape, Size
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, load_checkpoint, locate
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead, read_pixels
from model_adapters.hf.prompting.embedding import Embed
from model_adapters.hf.prompting.features import FeatureCache
from model_adapters.hf.prompting.native import EncodedImage, NativeEmbedder
from model_adapters.options.checkpoints import CheckpointOptions, CheckpointReading

R = TypeVar("R", bound=CheckpointReading)


class TextFamily(PlainFamily):
    """A family that reads text alone: the model is given token ids."""

    def __init__(self, model: Any, image_processor: Any = None, tokenizer: Any = None) -> None:
        self._model = model
        self.placeholder_id = self.slot_id = NO_TOKEN
        self.video = None
        self.mask_types: Mapping[str, Mapping[int, int]] = {}
        self.token_types: Mapping[str, Mapping[int, int]] = {}

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Refuse frames."""
        raise ModelError("the model reads text alone; a frame has no tokens")

    def template_ids(self, placeholder_id: int) -> tuple[int, ...]:
        """Return nothing: no token stands for a frame."""
        return ()

    def positions(self, ids: torch.Tensor, shapes: Sequence[Shape], start: int) -> torch.Tensor:
        """Return the positions of text, on as many axes as the model's."""
        core = getattr(self._model, "model", self._model)
        if hasattr(core, "get_rope_index"):
            return three_axis_positions(core, ids, NO_TOKEN, None, start)
        return super().positions(ids, shapes, start)

    def make_embed(self, max_bytes: int, ahead: Ahead) -> Embed:
        """Return what prepares spans of text."""
        pixels = PixelsAhead(partial(read_pixels, self), ahead)
        return NativeEmbedder(self._model, self, FeatureCache(pixels, self.encode, max_bytes))

    def encode(self, frames: Sequence[Pixels]) -> list[EncodedImage]:
        """Refuse frames."""
        raise NotImplementedError


class HfLm:
    """The adapter `hf-lm`."""

    Options: ClassVar[type] = CheckpointOptions

    @classmethod
    def build(
        cls,
        name: str,
        options: CheckpointOptions,
        seed: int,  # noqa: ARG003
    ) -> TransformersModel:
        """Load a checkpoint; the seed is not used."""
        loaded = load_checkpoint(cls.locate(name, options), TextFamily)
        model = TransformersModel(name, loaded, options)
        check_text(model, options.pretrained)
        return model

    @classmethod
    def locate(cls, name: str, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint of a language model."""
        if not options.pretrained:
            raise UsageError(f"{name} needs pretrained=..., a hub id or a folder")
        located = replace(locate(options), has_vision=False)
        model_type = located.config.model_type
        remote = options.trust_remote_code and "AutoModelForCausalLM" in getattr(
            located.config, "auto_map", {}
        )
        if model_type not in MODEL_FOR_CAUSAL_LM_MAPPING_NAMES and not remote:
            sees = model_type in MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES
            raise ModelError(
                f"{options.pretrained} is a {model_type} checkpoint, which "
                + ("has vision; use hf-vlm" if sees else "is no language model")
            )
        return located
