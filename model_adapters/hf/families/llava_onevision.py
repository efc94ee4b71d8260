"""LLaVA-OneVision: a frame of 300x300 takes 1485 tokens, an overview and the frame itself with a break per row."""

from collections.abc import Sequence

import torch
from PIL import Image

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.options.families import LlavaOnevisionOptions

__all__ = ["LlavaOnevision", "LlavaOnevisionFamily"]


class LlavaOnevisionFamily(PlainFamily):
    """Frames of LLaVA-OneVision, each cut into patches as if it were the only one.

    The processor takes a nested list of images as one multi-image sample and halves their tokens (730); published
    results come from the flat list, and so do these.
    """

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Packed features of overview, patches and row breaks, (tokens, hidden), for each image."""
        inputs = self._inputs(images)
        output = self._model.get_image_features(inputs["pixel_values"], inputs["image_sizes"], return_dict=True)
        return list(output.pooler_output)


class LlavaOnevision(CheckpointAdapter):
    """The adapter `llava-onevision`."""

    Options = LlavaOnevisionOptions
    family = LlavaOnevisionFamily
    model_types = ("llava_onevision",)
