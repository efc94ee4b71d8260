"""Qwen2.5-VL: a frame of 300x300 takes 121 tokens between markers, with three-axis positions.

Two frames of a video take 144 tokens together, all of a video between two markers (`qwen_video`).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import torch
from PIL import Image

from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.families.plain import PlainFamily, three_axis_positions
from model_adapters.hf.families.qwen_video import QwenVideo
from model_adapters.hf.family import ClipShape, Pixels, Shape, Size
from model_adapters.options.checkpoints import CheckpointOptions
from model_adapters.options.families import Qwen25VLNanoOptions, Qwen25VLOptions

NANO_FOLDER = "models/qwen2.5-vl-nano"


class Qwen25VLFamily(PlainFamily):
    """The family of Qwen2.5-VL."""

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self._grids: dict[Size, tuple[int, int, int]] = {}
        self._clips = QwenVideo(model, image_processor)
        self.video = self._clips

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return one token for each square of merged patches."""
        return (self.slot_id,) * (
            math.prod(self._grid(size)) // self._image_processor.merge_size**2
        )

    def template_ids(self, placeholder_id: int) -> tuple[int, ...]:
        """Return the placeholder between the vision markers, which the processor leaves to the
        template."""
        config = self._model.config
        return (config.vision_start_token_id, placeholder_id, config.vision_end_token_id)

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return the vision tower's merged patches of each frame, (tokens, hidden)."""
        inputs = self._inputs(frames)
        output = self._model.get_image_features(
            inputs["pixel_values"], inputs["image_grid_thw"], return_dict=True
        )
        return list(output.pooler_output)

    def positions(self, ids: torch.Tensor, shapes: Sequence[Shape], start: int) -> torch.Tensor:
        """Return temporal, height and width positions, (3, 1, tokens).

        See `three_axis_positions`; clips are numbered one by one.
        """
        rows = []
        for run in self._runs(ids, shapes):
            row = (
                self._clips.positions(run, start)
                if isinstance(run, ClipShape)
                else self._still(*run, start)
            )
            rows.append(row)
            start = max(start, int(row.max()) + 1)
        return torch.cat(rows, dim=-1)

    def _runs(
        self, ids: torch.Tensor, shapes: Sequence[Shape]
    ) -> Iterator[ClipShape | tuple[torch.Tensor, list[Size]]]:
        """Yield each clip of a span, and the ids between clips with the sizes of their frames."""
        left = list(shapes)
        for in_video, run in groupby(
            ids.tolist(), lambda token: token == self._clips.placeholder_id
        ):
            own = list(run)
            sizes = list[Size]()
            while left and own and isinstance(left[0], ClipShape) == in_video:
                shape = left.pop(0)
                if isinstance(shape, ClipShape):
                    yield shape
                    del own[: self._clips.n_tokens(shape)]
                else:
                    sizes.append(shape)
            if own:  # a model may also write the token of a video, which is a text then
                yield torch.tensor(own), sizes

    def _still(self, ids: torch.Tensor, sizes: Sequence[Size], start: int) -> torch.Tensor:
        """Return the positions of texts and frames."""
        grids = torch.tensor([self._grid(size) for size in sizes]) if sizes else None
        return three_axis_positions(self._model.model, ids, self.slot_id, grids, start)

    def _grid(self, size: Size) -> tuple[int, int, int]:
        """Return an image's patches along time, height and width, by the image processor."""
        if size not in self._grids:
            inputs = self._image_processor(images=[Image.new("RGB", size)], return_tensors="pt")
            time, height, width = inputs["image_grid_thw"][0].tolist()
            self._grids[size] = (time, height, width)
        return self._grids[size]


class Qwen25VL(CheckpointAdapter):
    """The adapter `qwen2.5-vl`."""

    Options = Qwen25VLOptions
    family = Qwen25VLFamily
    model_types = ("qwen2_5_vl",)


class Qwen25VLNano(CheckpointAdapter):
    """The adapter `qwen2.5-vl-nano`."""

    Options = Qwen25VLNanoOptions
    family = Qwen25VLFamily
    model_types = ("qwen2_5_vl",)

    @classmethod
    def build(cls, name: str, options: CheckpointOptions, seed: int) -> TransformersModel:
        """Load the checkpoint of the package, or another one of the same form.

        Raises:
            ModelError: the checkpoint cannot be loaded.
        """
        pretrained = options.pretrained or str(packaged_folder(NANO_FOLDER))
        return super().build(name, replace(options, pretrained=pretrained), seed)
