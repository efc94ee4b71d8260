"""Pixtral 12B: a frame of 300x300 takes 380 tokens, 19 rows of 19 and a token after each row."""

from collections.abc import Sequence
from typing import Any

import torch
from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.hf.family import Pixels, Size


class PixtralFamily(PlainFamily):
    """The family of LLaVA models with Pixtral's vision tower."""

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        if model.config.vision_config.model_type != "pixtral":
            raise ModelError(
                "the checkpoint is a LLaVA without Pixtral's vision tower; use hf-vlm for it"
            )
        vocabulary = tokenizer.get_vocab()
        if not {"[IMG_BREAK]", "[IMG_END]"} <= set(vocabulary):
            raise ModelError(
                "the checkpoint's tokenizer has no [IMG_BREAK] or no [IMG_END]; it is not Pixtral's"
            )
        self._break_id = vocabulary["[IMG_BREAK]"]
        self._end_id = vocabulary["[IMG_END]"]

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return rows of slots, each followed by a break, the last one by the end."""
        height, width = self.prepare(Image.new("RGB", size))["image_sizes"][0].tolist()
        side = self._model.model.vision_tower.patch_size
        row = (self.slot_id,) * (width // side) + (self._break_id,)
        return (*(row * (height // side))[:-1], self._end_id)

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return the projected patches of each frame, (tokens, hidden).

        Frames are encoded one by one: the vision tower joins a batch to one sequence with a mask
        over all pairs of patches, so the cost would be quadratic in the number of frames.
        """
        features: list[torch.Tensor] = []
        for frame in frames:
            features += self._encoded([frame], "pixel_values", "image_sizes")
        return features


class Pixtral(CheckpointAdapter):
    """The adapter `pixtral`."""

    family = PixtralFamily
    model_types = ("llava",)
