"""What families with ordinary, one-axis positions have in common."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from PIL import Image

from model_adapters.hf.family import Size

__all__ = ["PlainFamily"]


class PlainFamily:
    """Base of families that number tokens one by one and put a frame's features into equal slots.

    Subclasses compute features; how many slots a frame takes is what they make of a blank image of its size, so the
    count is always the model's own.

    Args:
        model: a transformers model with `config.image_token_id`.
        image_processor: the checkpoint's image processor.
        tokenizer: the checkpoint's tokenizer.
    """

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        self._model = model
        self._image_processor = image_processor
        self.placeholder_id: int = model.config.image_token_id
        self.slot_id = self.placeholder_id

    @torch.inference_mode()
    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """As many slots as a frame of this size has features."""
        return (self.slot_id,) * len(self.features([Image.new("RGB", size)])[0])

    def written_ids(self) -> tuple[int, ...]:
        """The placeholder alone."""
        return (self.placeholder_id,)

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Embeddings for the slots of each image, (slots, hidden)."""
        raise NotImplementedError

    def positions(self, ids: torch.Tensor, sizes: Sequence[Size], start: int) -> torch.Tensor:
        """Consecutive positions, (1, tokens)."""
        return torch.arange(start, start + len(ids), device=ids.device)[None]

    def _inputs(self, images: Sequence[Image.Image]) -> Mapping[str, torch.Tensor]:
        """The image processor's output on the model's device, pixels in the model's type."""
        inputs = self._image_processor(images=list(images), return_tensors="pt")
        weight = self._model.get_input_embeddings().weight
        # Of an outline's pixels the shapes are enough; what is counted by has to have values.
        counts = torch.device("cpu") if weight.is_meta else weight.device
        return {
            name: value.to(weight.device, self._model.dtype) if value.is_floating_point() else value.to(counts)
            for name, value in inputs.items()
        }
