"""LLaVA-OneVision: a frame of 300x300 takes 1485 tokens: overview, frame, breaks after rows.

A frame of a video takes 196 tokens, and a break follows the last one. The checkpoint's own video
processor needs torchvision, so pixels come from its image processor: the overview of an image is
the whole frame in the size of the vision tower, which is what a frame of a video is scaled to.
"""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any

import torch
from PIL import Image

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.hf.family import ClipShape, Pixels

_POOLED = 2  # patches along a side that are pooled to one token


class LlavaOnevisionFamily(PlainFamily):
    """The family of LLaVA-OneVision; each frame is processed as a single image.

    The processor treats a nested list of images as one multi-image sample and halves their tokens
    (730). Frames are passed as a flat list, as in the published results.
    """

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self.video = _LlavaVideo(model, image_processor)

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return each frame's packed features, (tokens, hidden): overview, patches, row breaks."""
        features: list[torch.Tensor] = []
        for _, alike in groupby(frames, lambda frame: frame["pixel_values"].shape):
            features += self._encoded(list(alike), "pixel_values", "image_sizes")
        return features


class LlavaOnevision(CheckpointAdapter):
    """The adapter `llava-onevision`."""

    family = LlavaOnevisionFamily
    model_types = ("llava_onevision",)


class _LlavaVideo:
    """The video input of LLaVA-OneVision; a clip is a frame."""

    clip_frames = 1

    def __init__(self, model: Any, image_processor: Any) -> None:
        self._model = model
        self._image_processor = image_processor
        self.placeholder_id: int = model.config.video_token_id

    def n_tokens(self, shape: ClipShape) -> int:
        """Return a token for each square of pooled patches, and one for the last frame's break."""
        vision = self._model.config.vision_config
        side = math.ceil(vision.image_size // vision.patch_size / _POOLED)
        return side**2 + _is_last(shape)

    def prepare(self, shape: ClipShape, images: Sequence[Image.Image]) -> Pixels:
        """Return the overview of the clip's frame."""
        inputs = self._image_processor(images=list(images), return_tensors="pt")
        return {"pixel_values": inputs["pixel_values"][:, 0]}

    def features_of(self, clips: Sequence[tuple[ClipShape, Pixels]]) -> list[torch.Tensor]:
        """Return the pooled patches of each frame, (tokens, hidden), with the break after the last
        frame of a video."""
        overviews = torch.cat([pixels["pixel_values"] for _, pixels in clips])
        weight = self._model.get_input_embeddings().weight
        output = self._model.get_video_features(
            overviews.to(weight.device, self._model.dtype)[None], return_dict=True
        )
        features = output.pooler_output[0]
        pooled = features[:-1].chunk(len(clips))
        line_break = features[-1:]
        return [
            torch.cat([own, line_break]) if _is_last(shape) else own
            for own, (shape, _) in zip(pooled, clips, strict=True)
        ]


def _is_last(shape: ClipShape) -> bool:
    return shape.number == shape.n_clips - 1
