"""LLaVA-OneVision: a frame of 300x300 takes 1485 tokens: overview, frame, breaks after rows.

A frame of a video takes 196 tokens (`llava_video`).
"""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import torch

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.llava_video import LlavaVideo
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.hf.family import Pixels
from model_adapters.options.families import LlavaOnevisionOptions


class LlavaOnevisionFamily(PlainFamily):
    """The family of LLaVA-OneVision; each frame is processed as a single image.

    The processor treats a nested list of images as one multi-image sample and halves their tokens
    (730). Frames are passed as a flat list, as in the published results.
    """

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self.video = LlavaVideo(model, image_processor)

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return each frame's packed features, (tokens, hidden): overview, patches, row breaks."""
        features = []
        for _, alike in groupby(frames, lambda frame: frame["pixel_values"].shape):
            inputs = self._inputs(list(alike))
            output = self._model.get_image_features(
                inputs["pixel_values"], inputs["image_sizes"], return_dict=True
            )
            features.extend(output.pooler_output)
        return features


class LlavaOnevision(CheckpointAdapter):
    """The adapter `llava-onevision`."""

    Options = LlavaOnevisionOptions
    family = LlavaOnevisionFamily
    model_types = ("llava_onevision",)
