"""Qwen2.5-VL: a frame of 300x300 takes 121 tokens between markers, with three-axis positions.

Two frames of a video make a temporal patch, 144 tokens together for 300x300, all of a video between
two markers. Frames are sized as qwen-vl-utils does it, which the published evaluation used. The
checkpoint's own video processor needs torchvision, so pixels come from its image processor, which
scales each frame by PIL.
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
from model_adapters.hf.family import ClipShape, Pixels, Shape, Size
from model_adapters.options.checkpoints import CheckpointOptions
from model_adapters.options.families import PixelOptions

NANO_FOLDER = "models/qwen2.5-vl-nano"
# Limits of qwen-vl-utils (VIDEO_MIN_PIXELS, VIDEO_MAX_PIXELS, VIDEO_TOTAL_PIXELS), in pixels.
_MIN_PIXELS = 128 * 28 * 28
_MAX_PIXELS = 768 * 28 * 28
_TOTAL_PIXELS = int(128_000 * 28 * 28 * 0.9)
_MARGIN = 1.05  # of the upper limit above the lower one


class Qwen25VLFamily(PlainFamily):
    """The family of Qwen2.5-VL."""

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self._grids: dict[Size, tuple[int, int, int]] = {}
        self._clips = _QwenVideo(model, image_processor)
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
        return self._encoded(frames, "pixel_values", "image_grid_thw")

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

    Options = PixelOptions
    family = Qwen25VLFamily
    model_types = ("qwen2_5_vl",)


class Qwen25VLNano(Qwen25VL):
    """The adapter `qwen2.5-vl-nano`."""

    @classmethod
    def build(cls, name: str, options: CheckpointOptions, seed: int) -> TransformersModel:
        """Load the checkpoint of the package, or another one of the same form."""
        pretrained = options.pretrained or str(packaged_folder(NANO_FOLDER))
        return super().build(name, replace(options, pretrained=pretrained), seed)


class _QwenVideo:
    """The video input of Qwen2-VL and Qwen2.5-VL; a clip is a temporal patch."""

    def __init__(self, model: Any, image_processor: Any) -> None:
        self._model = model
        self._image_processor = image_processor
        self._sides: dict[tuple[Size, int], tuple[int, int]] = {}
        self.placeholder_id: int = model.config.video_token_id
        self.clip_frames: int = image_processor.temporal_patch_size

    def n_tokens(self, shape: ClipShape) -> int:
        """Return one token for each square of merged patches."""
        return math.prod(self._merged_sides(shape))

    def prepare(self, shape: ClipShape, images: Sequence[Image.Image]) -> Pixels:
        """Return a clip's patches, and how many there are along time, height and width."""
        inputs = self._image_processor(
            images=list(images), size=self._limits(shape), return_tensors="pt"
        )
        return {
            "pixel_values": self._interleave(inputs["pixel_values"], len(images)),
            "image_grid_thw": inputs["image_grid_thw"][:1],
        }

    def features_of(self, clips: Sequence[tuple[ClipShape, Pixels]]) -> list[torch.Tensor]:
        """Return the vision tower's merged patches of each clip, (tokens, hidden).

        The tower attends within a temporal patch only, so clips can be encoded one by one as well
        as together.
        """
        pixels = torch.cat([pixels["pixel_values"] for _, pixels in clips])
        grids = torch.cat([pixels["image_grid_thw"] for _, pixels in clips])
        weight = self._model.get_input_embeddings().weight
        output = self._model.get_video_features(
            pixels.to(weight.device, self._model.dtype),
            grids.to(torch.device("cpu") if weight.is_meta else weight.device),
            return_dict=True,
        )
        return list(output.pooler_output)

    def positions(self, shape: ClipShape, start: int) -> torch.Tensor:
        """Return temporal, height and width positions of a clip's tokens, (3, 1, tokens).

        Rows and columns count from the start of the video. Time does so too, in steps of the
        video's real time, so that the clips of a slow sampling are farther apart. Whatever follows
        a video begins behind its largest position on any axis, as the model was trained;
        get_rope_index of transformers 5 counts rows and columns alone.

        Args:
            shape: shape of the clip.
            start: position behind everything before the clip, earlier clips of the video included.
        """
        height, width = self._merged_sides(shape)
        first = start - (self._n_positions(shape, shape.number - 1) if shape.number else 0)
        time = torch.full((height * width,), first + self._time(shape, shape.number))
        rows = torch.arange(first, first + height).repeat_interleave(width)
        columns = torch.arange(first, first + width).repeat(height)
        return torch.stack([time, rows, columns])[:, None]

    def _n_positions(self, shape: ClipShape, number: int) -> int:
        """Return the number of positions of a video up to and with a clip of this number."""
        return max(self._time(shape, number) + 1, *self._merged_sides(shape))

    def _time(self, shape: ClipShape, number: int) -> int:
        """Return a clip's temporal position; Qwen2-VL counts clips, Qwen2.5-VL time."""
        per_second = getattr(self._model.config.vision_config, "tokens_per_second", None)
        return number if per_second is None else int(number * per_second * shape.seconds)

    def _merged_sides(self, shape: ClipShape) -> tuple[int, int]:
        """Return the merged patches of a clip along height and width, by the image processor."""
        key = shape.size, shape.n_clips
        if key not in self._sides:
            blank = Image.new("RGB", shape.size)
            inputs = self._image_processor(
                images=[blank], size=self._limits(shape), return_tensors="pt"
            )
            _, height, width = inputs["image_grid_thw"][0].tolist()
            merge = self._image_processor.merge_size
            self._sides[key] = height // merge, width // merge
        return self._sides[key]

    def _limits(self, shape: ClipShape) -> dict[str, int]:
        """Return the limits of a frame's area: qwen-vl-utils', within the image processor's.

        The clips of a long video share the pixels that a video may have.
        """
        size = self._image_processor.size
        least = size["shortest_edge"]
        most = size["longest_edge"]
        lower = min(max(_MIN_PIXELS, least), most)
        upper = max(min(_MAX_PIXELS, _TOTAL_PIXELS / shape.n_clips), lower * _MARGIN)
        return {"shortest_edge": lower, "longest_edge": int(min(max(upper, least), most))}

    def _interleave(self, pixels: torch.Tensor, n_frames: int) -> torch.Tensor:
        """Return a clip's patches, (patches, channels x frames x area), from its frames'.

        The image processor repeats an image along time; of each frame, its own place in time is
        taken.
        """
        area = self._image_processor.patch_size**2
        by_frame = pixels.reshape(
            n_frames, -1, pixels.shape[-1] // (n_frames * area), n_frames, area
        )
        return torch.stack(
            [by_frame[index, :, :, index] for index in range(n_frames)], dim=2
        ).flatten(1)
