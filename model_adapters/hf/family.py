"""What has to be known about a model family, and nowhere else."""

from collections.abc import Sequence
from typing import Any, Protocol

import torch
from PIL import Image

__all__ = ["Family", "MakeFamily", "Size"]

Size = tuple[int, int]  # width, height in pixels


class Family(Protocol):
    """A loaded model's family: how frames become tokens, features and positions.

    Attributes:
        placeholder_id: the id that one frame leaves in the tokenised chat template.
        slot_id: the id whose embeddings the frame's features replace.
    """

    placeholder_id: int
    slot_id: int

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """The ids that the placeholder of a frame of this size expands to."""
        ...

    def written_ids(self) -> tuple[int, ...]:
        """The ids that a chat template writes for a frame: the placeholder and, in some families, markers around it."""
        ...

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Embeddings for the slots of each image, (slots, hidden), on the embedding layer's device.

        They can be trained through; whoever only evaluates asks under `torch.inference_mode`.
        """
        ...

    def positions(self, ids: torch.Tensor, sizes: Sequence[Size], start: int) -> torch.Tensor:
        """Position ids of a stretch of a sequence that has whole frames only.

        Args:
            ids: (tokens,), frames expanded, on the CPU.
            sizes: of the frames in it.
            start: the position that the first token takes.

        Returns:
            (1, tokens), or (3, 1, tokens) where positions have three axes, on the CPU.
        """
        ...


class MakeFamily(Protocol):
    """A class of families: made of a model, an image processor and a tokenizer."""

    def __call__(self, model: Any, image_processor: Any, tokenizer: Any) -> Family:
        """Make the family of these loaded parts."""
        ...
