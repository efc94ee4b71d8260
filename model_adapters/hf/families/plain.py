"""Base of families with one-axis positions."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import torch
from PIL import Image

from model_adapters.hf.family import Pixels, Shape, Size, VideoInput
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead, read_pixels
from model_adapters.hf.prompting.embedding import Embed, Embedder
from model_adapters.hf.prompting.features import FeatureCache


class PlainFamily:
    """Base of families with consecutive positions, whose frames consist of equal slots,
    `config.image_token_id`.

    Subclasses compute features. The slots of a frame are counted on a blank image of its size, so
    the count is always that of the model.
    """

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        self._model = model
        self._image_processor = image_processor
        self.placeholder_id: int = model.config.image_token_id
        self.slot_id = self.placeholder_id
        self.video: VideoInput | None = None

    @torch.inference_mode()
    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return one slot for each feature of a frame of this size."""
        return (self.slot_id,) * len(self.features([Image.new("RGB", size)])[0])

    def template_ids(self, placeholder_id: int) -> tuple[int, ...]:
        """Return the placeholder alone."""
        return (placeholder_id,)

    def prepare(self, image: Image.Image) -> Pixels:
        """Return the image processor's output for a frame."""
        pixels: Pixels = self._image_processor(images=[image], return_tensors="pt")
        return pixels

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Return the embeddings for the slots of each image, (slots, hidden)."""
        return self.features_of([self.prepare(image) for image in images])

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return the embeddings for the slots of each prepared frame, (slots, hidden)."""
        raise NotImplementedError

    def make_embed(self, max_bytes: int, ahead: Ahead) -> Embed:
        """Return what embeds spans of prompts, with a cache of so many bytes of features."""
        clips = None if self.video is None else self.video.features_of
        pixels = PixelsAhead(partial(read_pixels, self), ahead)
        return Embedder(self._model, self, FeatureCache(pixels, self.features_of, max_bytes, clips))

    def positions(self, ids: torch.Tensor, shapes: Sequence[Shape], start: int) -> torch.Tensor:
        """Return consecutive positions, (1, tokens)."""
        return torch.arange(start, start + len(ids), device=ids.device)[None]

    def _encoded(self, frames: Sequence[Pixels], *names: str) -> list[torch.Tensor]:
        """Return what the model makes of these inputs of prepared frames, encoded together."""
        inputs = self._inputs(frames)
        chosen = {name: inputs[name] for name in names}
        output = self._model.model.get_image_features(**chosen, return_dict=True)
        return list(output.pooler_output)

    def _inputs(self, frames: Sequence[Pixels]) -> Pixels:
        """Return prepared frames as one input on the model's device, pixels in the model's type."""
        inputs = {name: torch.cat([frame[name] for frame in frames]) for name in frames[0]}
        weight = self._model.get_input_embeddings().weight
        # Without weights (meta device) only shapes of pixels are used, but counts need values.
        counts = torch.device("cpu") if weight.is_meta else weight.device
        return {
            name: value.to(weight.device, self._model.dtype)
            if value.is_floating_point()
            else value.to(counts)
            for name, value in inputs.items()
        }


def three_axis_positions(
    model: Any, ids: torch.Tensor, slot_id: int, grids: torch.Tensor | None, start: int
) -> torch.Tensor:
    """Return temporal, height and width positions, (3, 1, tokens), on the CPU.

    The model's own rule counts from the first token, and all positions shift with it. So a span
    that cuts no frame is numbered alone and shifted, which makes chunked prefill equal to one pass.

    Args:
        model: the model without its output layer, which has the rule.
        ids: token ids of the span, (tokens,).
        slot_id: id of the tokens of frames.
        grids: patches of each frame along time, height and width, (frames, 3); None without frames.
        start: position behind everything before the span.
    """
    if grids is None:
        return torch.arange(start, start + len(ids)).expand(3, 1, -1)
    positions: torch.Tensor
    positions, _ = model.get_rope_index(
        ids[None], mm_token_type_ids=(ids == slot_id).int()[None], image_grid_thw=grids
    )
    return positions + start
