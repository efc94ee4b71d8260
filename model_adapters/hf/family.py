"""Protocol of a model family: everything that differs between families."""

from collections.abc import Sequence
from typing import Any, Protocol

import torch
from PIL import Image

__all__ = ["Family", "MakeFamily", "Size"]

Size = tuple[int, int]  # width, height in pixels


class Family(Protocol):
    """Conversion of frames to tokens, features and positions for a loaded model.

    Attributes:
        placeholder_id: token id of a frame in the tokenised chat template.
        slot_id: token id whose embeddings are replaced by the frame's features.
    """

    placeholder_id: int
    slot_id: int

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return the ids that the placeholder of a frame of this size expands to."""

    def template_ids(self) -> tuple[int, ...]:
        """Return the ids of a frame in a template: the placeholder and, in some families, markers around it."""

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Return the embeddings for the slots of each image, (slots, hidden), on the embedding layer's device.

        They carry gradients, for training; inference calls this under `torch.inference_mode`.
        """

    def positions(self, ids: torch.Tensor, sizes: Sequence[Size], start: int) -> torch.Tensor:
        """Return the position ids of a span of a sequence that cuts no frame.

        Args:
            ids: token ids, (tokens,), frames expanded, on the CPU.
            sizes: sizes of the frames in the span.
            start: position of the first token.

        Returns:
            Positions, (1, tokens), or (3, 1, tokens) for positions with three axes, on the CPU.
        """


class MakeFamily(Protocol):
    """A function that builds the family of a model, an image processor and a tokenizer."""

    def __call__(self, model: Any, image_processor: Any, tokenizer: Any) -> Family:
        """Build the family of these loaded parts."""
