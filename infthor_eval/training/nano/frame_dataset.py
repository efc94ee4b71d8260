"""Frames of the training data as inputs of the vision tower, with labels of the objects in them."""

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
from infthor_eval.storage.digests import fingerprint
from infthor_eval.training.data import trajectory_names
from infthor_eval.training.nano.architecture import GRID, PATCHES, TOKENS

__all__ = ["FrameDataset", "read_frame_dataset"]

_READER_THREADS = 2
# smallest object that counts as shown: a thousandth of a 300 x 300 frame, as in the questions
_LEAST_PIXELS = 90
# An object is in a cell if its box covers this share of the cell, or has this share of its own area
# in the cell.
_OF_CELL = 0.4
_OF_OBJECT = 0.5


@dataclass(frozen=True)
class FrameDataset:
    """Frames with labels; labels are 0 or 1.

    Attributes:
        frames: distinct frames.
        types: object types, sorted.
        pixels: patches of each frame, (frames, patches, values), in float16. The tower reads each
            frame twice, as two time steps of a video; this has one of them.
        cells: types in each token's part of the frame, (frames, tokens, types).
        visible: types that the frame shows near enough to be visible in AI2-THOR's sense, (frames,
            types).
        present: types with any pixel in the frame, (frames, types).
    """

    frames: tuple[FrameRef, ...]
    types: tuple[str, ...]
    pixels: Tensor
    cells: Tensor
    visible: Tensor
    present: Tensor

    def identity(self) -> str:
        """Return the hash of the frames in their order, and of the types."""
        digests = [frame.digest for frame in self.frames]
        return fingerprint({"frames": digests, "types": list(self.types)})

    def index_by_digest(self) -> dict[str, int]:
        """Return the index of each frame by the digest of its file."""
        return {frame.digest: index for index, frame in enumerate(self.frames)}


def read_frame_dataset(folders: Iterable[Path], image_processor: Any) -> FrameDataset:
    """Read all frames of the folders of replayed sets.

    Raises:
        DataError: a set cannot be read, or its step log does not list the objects in frames.
    """
    frames: dict[str, tuple[FrameRef, Step]] = {}
    for folder in folders:
        data = NiehSet(folder)
        for name in trajectory_names(data):
            folder_of_steps = data.folder(name)
            steps = sorted(read_steps(folder_of_steps), key=lambda step: step.img_idx)
            if any(step.seen is None for step in steps):
                raise DataError(
                    f"{folder_of_steps}: does not list the objects in its frames; replay the "
                    "trajectory"
                )
            for frame, step in zip(data.frames(name), steps, strict=True):
                frames.setdefault(frame.digest, (frame, step))
    entries = list(frames.values())
    types = sorted({_type(key) for _, step in entries for key in step.seen or ()})
    labels = [_labels(step.seen or {}, types, frame.size) for frame, step in entries]
    cells, visible, present = map(torch.stack, zip(*labels, strict=True))
    # Decoding and resizing release the interpreter lock.
    with ThreadPoolExecutor(_READER_THREADS) as readers:
        pixels = torch.stack(
            list(readers.map(lambda entry: _patches(entry[0], image_processor), entries))
        )
    return FrameDataset(
        tuple(frame for frame, _ in entries), tuple(types), pixels, cells, visible, present
    )


def _patches(frame: FrameRef, image_processor: Any) -> Tensor:
    pixels: Tensor = image_processor(images=[frame.load()], return_tensors="pt")["pixel_values"]
    if len(pixels) != PATCHES:
        raise DataError(f"{frame.path}: is not square; use square frames")
    return pixels.reshape(PATCHES, 3, 2, -1)[:, :, 0].reshape(PATCHES, -1).half()


def _type(key: str) -> str:
    """Return the type in an object's id; that of the part or slice for "...|SinkBasin" and
    "...|AppleSliced_1"."""
    first, *_, last = key.split("|")
    return last.partition("_")[0] if last[:1].isalpha() else first


def _labels(
    seen: dict[str, ObjectInFrame], types: Sequence[str], size: tuple[int, int]
) -> tuple[Tensor, Tensor, Tensor]:
    cells = torch.zeros(TOKENS, len(types))
    visible = torch.zeros(len(types))
    present = torch.zeros(len(types))
    coverage = _cell_coverage(
        torch.tensor([instance.box for instance in seen.values()]).reshape(-1, 4), size
    )
    for (key, instance), in_cells in zip(seen.items(), coverage, strict=True):
        column = types.index(_type(key))
        present[column] = 1
        if instance.visible and instance.pixels >= _LEAST_PIXELS:
            visible[column] = 1
        cells[:, column] = torch.maximum(cells[:, column], in_cells)
    return cells, visible, present


def _cell_coverage(boxes: Tensor, size: tuple[int, int]) -> Tensor:
    """Return the cells of a frame that boxes are in, (boxes, tokens), row by row, as 0 or 1."""
    left, top, right, bottom = boxes.T
    spans = []
    for low, high, extent in ((top, bottom + 1, size[1]), (left, right + 1, size[0])):
        edges = torch.arange(GRID + 1) * (extent / GRID)
        overlap = torch.minimum(edges[1:], high[:, None]) - torch.maximum(edges[:-1], low[:, None])
        spans.append(overlap.clamp(min=0) / (extent / GRID))
    area = spans[0][:, :, None] * spans[1][:, None, :]  # in units of cells
    box_area = (right + 1 - left) * (bottom + 1 - top) / (size[0] * size[1]) * TOKENS
    return ((area >= _OF_CELL) | (area >= _OF_OBJECT * box_area[:, None, None])).float().flatten(1)
