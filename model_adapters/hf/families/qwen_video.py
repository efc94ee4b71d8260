"""The video input of Qwen2.5-VL: two frames make a temporal patch, 144 tokens for 300x300.

Frames are sized as qwen-vl-utils does it, which the published evaluation used. The checkpoint's own
video processor needs torchvision, so pixels come from its image processor, which scales each frame
by PIL.
"""

import math
from collections.abc import Sequence
from typing import Any

import torch
from PIL import Image

from model_adapters.hf.family import ClipShape, Pixels, Size

# Limits of qwen-vl-utils (VIDEO_MIN_PIXELS, VIDEO_MAX_PIXELS, VIDEO_TOTAL_PIXELS), in pixels.
_MIN_PIXELS = 128 * 28 * 28
_MAX_PIXELS = 768 * 28 * 28
_TOTAL_PIXELS = int(128_000 * 28 * 28 * 0.9)
_MARGIN = 1.05  # of the upper limit above the lower one


class QwenVideo:
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
