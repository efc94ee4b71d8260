"""All frames that the small model is trained on, as what its vision tower takes, and what is to be seen in them."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import ObjectInFrame, Step, read_steps
from infthor_eval.training.data import trajectory_names
from infthor_eval.training.nano.architecture import GRID, PATCHES, TOKENS

__all__ = ["FrameDataset", "read_frame_dataset"]

_READERS = 2  # threads
_LEAST_PIXELS = 90  # of an object that counts as shown: a thousandth of a frame of 300 x 300, as in the questions
_OF_CELL, _OF_OBJECT = 0.4, 0.5  # shares of a cell, or of an object, that lie within each other where it is seen there


@dataclass(frozen=True)
class FrameDataset:
    """Frames and what they show.

    Attributes:
        frames: each once.
        types: of objects, sorted.
        pixels: (frames, patches, values) of one of the two equal moments that the tower wants, float16.
        cells: (frames, tokens, types), whether a token's part of the frame shows a type.
        shown: (frames, types), whether the frame shows it near enough to be visible in AI2-THOR's sense.
        present: (frames, types), whether anything of it is in the frame.
    """

    frames: tuple[FrameRef, ...]
    types: tuple[str, ...]
    pixels: Tensor
    cells: Tensor
    shown: Tensor
    present: Tensor

    def places(self) -> dict[str, int]:
        """Digest of a frame's file to its place in the album."""
        return {frame.digest: at for at, frame in enumerate(self.frames)}

    def tower_inputs(self, places: Sequence[int]) -> Tensor:
        """What the vision tower is fed for some frames, (frames x patches, values)."""
        chosen = self.pixels[list(places)].float().reshape(len(places) * PATCHES, 3, 1, -1)
        return chosen.expand(-1, -1, 2, -1).reshape(len(places) * PATCHES, -1)


def read_frame_dataset(folders: Iterable[Path], image_processor: Any) -> FrameDataset:
    """Read all frames of replayed sets.

    Args:
        folders: of the sets.
        image_processor: the model's.

    Raises:
        DataError: a set cannot be read, or does not say what its frames show.
    """
    frames: dict[str, tuple[FrameRef, Step]] = {}
    for folder in folders:
        data = NiehSet(folder)
        for name in trajectory_names(data):
            place = data.folder(name)
            steps = sorted(read_steps(place), key=lambda step: step.img_idx)
            if any(step.seen is None for step in steps):
                raise DataError(f"{place}: does not say what its frames show; replay the trajectory")
            for frame, step in zip(data.frames(name), steps, strict=True):
                frames.setdefault(frame.digest, (frame, step))
    found = list(frames.values())
    types = sorted({_type(key) for _, step in found for key in step.seen or ()})
    labels = [_labels(step.seen or {}, types, frame.size) for frame, step in found]
    cells, shown, present = (torch.stack(parts) for parts in zip(*labels, strict=True))
    with ThreadPoolExecutor(_READERS) as readers:  # decoding and resizing let go of the interpreter
        pixels = torch.stack(list(readers.map(lambda one: _patches(one[0], image_processor), found)))
    return FrameDataset(tuple(frame for frame, _ in found), tuple(types), pixels, cells, shown, present)


def _patches(frame: FrameRef, image_processor: Any) -> Tensor:
    made = image_processor(images=[frame.load()], return_tensors="pt")
    pixels: Tensor = made["pixel_values"]
    if len(pixels) != PATCHES:
        raise DataError(f"{frame.path}: is not square; train on square frames")
    return pixels.reshape(PATCHES, 3, 2, -1)[:, :, 0].reshape(PATCHES, -1).half()


def _type(key: str) -> str:
    """The type in an object's id: that of a part ("...|SinkBasin") or a slice ("...|AppleSliced_1") where it is one."""
    first, *_, last = key.split("|")
    return last.partition("_")[0] if last[:1].isalpha() else first


def _labels(
    seen: dict[str, ObjectInFrame], types: Sequence[str], size: tuple[int, int]
) -> tuple[Tensor, Tensor, Tensor]:
    cells = torch.zeros(TOKENS, len(types))
    shown, present = torch.zeros(len(types)), torch.zeros(len(types))
    covered = _cell_coverage(torch.tensor([item.box for item in seen.values()]).reshape(-1, 4), size)
    for (key, item), within in zip(seen.items(), covered, strict=True):
        at = types.index(_type(key))
        present[at] = 1
        if item.visible and item.pixels >= _LEAST_PIXELS:
            shown[at] = 1
        cells[:, at] = torch.maximum(cells[:, at], within)
    return cells, shown, present


def _cell_coverage(boxes: Tensor, size: tuple[int, int]) -> Tensor:
    """In which cells of a frame boxes lie, (boxes, tokens), row by row."""
    left, top, right, bottom = boxes.T
    spans = []
    for low, high, extent in ((top, bottom + 1, size[1]), (left, right + 1, size[0])):
        edges = torch.arange(GRID + 1) * (extent / GRID)
        overlap = torch.minimum(edges[1:], high[:, None]) - torch.maximum(edges[:-1], low[:, None])
        spans.append(overlap.clamp(min=0) / (extent / GRID))
    area = spans[0][:, :, None] * spans[1][:, None, :]  # in cells
    whole = (right + 1 - left) * (bottom + 1 - top) / (size[0] * size[1]) * TOKENS
    return ((area >= _OF_CELL) | (area >= _OF_OBJECT * whole[:, None, None])).float().flatten(1)
