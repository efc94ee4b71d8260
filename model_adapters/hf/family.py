"""Protocol of a model family: everything that differs between families."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import torch
from PIL import Image

if TYPE_CHECKING:
    from model_adapters.hf.prompting.ahead import Ahead
    from model_adapters.hf.prompting.embedding import Embed

Size = tuple[int, int]  # width, height in pixels
NO_TOKEN = -1  # in place of a token id
Pixels = Mapping[str, torch.Tensor]  # what an image processor makes of a frame or a clip


@dataclass(frozen=True)
class ClipShape:
    """All that a clip's tokens and positions depend on: a video's frames, encoded together.

    Attributes:
        size: width and height of the video's frames, in pixels.
        number: number of the clip in its video, from 0.
        n_clips: clips of the video.
        seconds: time from one clip to the next.
    """

    size: Size
    number: int
    n_clips: int
    seconds: float


Shape = Size | ClipShape  # of a frame, or of a clip


class VideoInput(Protocol):
    """Conversion of videos to tokens and features, clip by clip.

    Attributes:
        placeholder_id: token id of a video in the tokenised chat template, and of each token that
            it expands to.
        clip_frames: frames of a clip; the last one is repeated where a video has too few.
    """

    placeholder_id: int
    clip_frames: int

    def n_tokens(self, shape: ClipShape) -> int:
        """Return the number of tokens of a clip."""

    def prepare(self, shape: ClipShape, images: Sequence[Image.Image]) -> Pixels:
        """Return what the image processor makes of a clip's frames; see `Family.prepare`."""

    def features_of(self, clips: Sequence[tuple[ClipShape, Pixels]]) -> list[torch.Tensor]:
        """Return embeddings for each clip's tokens, (tokens, hidden), on the embeddings' device."""


class Family(Protocol):
    """Conversion of frames to tokens, features and positions for a loaded model.

    Attributes:
        placeholder_id: token id of a frame in the tokenised chat template; `NO_TOKEN` for a family
            that takes no frames.
        slot_id: token id whose embeddings are replaced by the frame's features.
        video: conversion of videos, or None for a family without a video input.
    """

    placeholder_id: int
    slot_id: int
    video: VideoInput | None

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return the ids that the placeholder of a frame of this size expands to."""

    def template_ids(self, placeholder_id: int) -> tuple[int, ...]:
        """Return the ids of a frame or a video in a template: its placeholder and, in some
        families, markers."""

    def prepare(self, image: Image.Image) -> Pixels:
        """Return what the image processor makes of a frame, on the CPU.

        It is called from several threads at the same time.
        """

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Return embeddings for each image's slots, (slots, hidden), on the embeddings' device.

        They carry gradients, for training; inference calls this under `torch.inference_mode`.
        """

    def make_embed(self, max_bytes: int, ahead: "Ahead") -> "Embed":
        """Return what prepares spans of prompts, with a cache of so many bytes of features."""

    def positions(self, ids: torch.Tensor, shapes: Sequence[Shape], start: int) -> torch.Tensor:
        """Return the position ids of a span of a sequence that cuts no frame and no clip.

        Args:
            ids: token ids, (tokens,), frames and clips expanded, on the CPU.
            shapes: shapes of the frames and clips in the span, in order.
            start: position behind everything before the span.

        Returns:
            Positions, (1, tokens), or (3, 1, tokens) for positions with three axes, on the CPU.
        """


class MakeFamily(Protocol):
    """A function that builds the family of a model, an image processor and a tokenizer."""

    def __call__(self, model: Any, image_processor: Any, tokenizer: Any) -> Family:
        """Build the family of these loaded parts."""
