"""Frames of the training data as inputs of the vision tower, with labels of what they show."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.digests import fingerprint
from infthor_eval.training.nano.architecture import PATCHES
from infthor_eval.training.nano.seen_objects import SeenFrame, SeenObject, read_seen_frames

__all__ = ["CellLabels", "FrameDataset", "cell_coverage", "read_frame_dataset"]

_READER_THREADS = 2
# An object is in a cell if its box covers this share of the cell, or has there this share of what
# it has in the cell with most of it.
_OF_CELL = 0.4
_OF_LARGEST = 0.5
_LEAST_RELATIONS = 10  # frames that have to show a type in a receptacle before it is a label


@dataclass(frozen=True)
class CellLabels:
    """What each token's part of a frame shows; labels are True or False.

    Attributes:
        types: types of the objects there, (frames, tokens, types).
        held: types of those in the agent's hand, (frames, tokens, types).
        opened: types of those that are open, (frames, tokens, types).
        related: type and receptacle of the objects there, (frames, tokens, relations).
    """

    types: Tensor
    held: Tensor
    opened: Tensor
    related: Tensor


@dataclass(frozen=True)
class FrameDataset:
    """Frames with labels.

    Attributes:
        seen: distinct frames with the objects in them.
        types: object types, sorted.
        relations: frequent pairs of a type and the type of the receptacle it is in, sorted.
        pixels: patches of each frame, (frames, patches, values), in float16. The tower reads each
            frame twice, as two time steps of a video; this has one of them.
        cells: labels of each token's part of the frame.
        shown: types that the frame shows near enough to be visible in AI2-THOR's sense, (frames,
            types), True or False.
        present: types with any pixel in the frame, (frames, types), True or False.
    """

    seen: tuple[SeenFrame, ...]
    types: tuple[str, ...]
    relations: tuple[tuple[str, str], ...]
    pixels: Tensor
    cells: CellLabels
    shown: Tensor
    present: Tensor

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.seen)

    def identity(self) -> str:
        """Return the hash of the frames in their order, and of the types."""
        digests = [frame.digest for frame, _ in self.seen]
        return fingerprint({"frames": digests, "types": list(self.types)})

    def index_by_digest(self) -> dict[str, int]:
        """Return the index of each frame by the digest of its file."""
        return {frame.digest: index for index, (frame, _) in enumerate(self.seen)}


def read_frame_dataset(folders: Iterable[Path], image_processor: Any, grid: int) -> FrameDataset:
    """Read all frames of the folders of replayed sets.

    Args:
        folders: folders of the sets.
        image_processor: makes the inputs of the tower.
        grid: tokens along each side of a frame.

    Raises:
        DataError: a set cannot be read, or its step log does not list the objects in frames.
    """
    seen = read_seen_frames(folders)
    objects = [one for _, in_frame in seen for one in in_frame]
    types = sorted({one.type for one in objects})
    pairs = Counter((one.type, one.parent) for one in objects)
    relations = sorted(
        (name, parent)
        for (name, parent), n in pairs.items()
        if parent is not None and n >= _LEAST_RELATIONS
    )
    rows = torch.tensor([row for row, (_, in_frame) in enumerate(seen) for _ in in_frame])
    # Decoding and resizing release the interpreter lock.
    with ThreadPoolExecutor(_READER_THREADS) as readers:
        pixels = torch.stack(
            list(readers.map(lambda entry: _patches(entry.frame, image_processor), seen))
        )
    shown, present = torch.zeros(2, len(seen), len(types), dtype=torch.bool)
    columns = _columns(types, (one.type for one in objects))
    present[rows, columns] = True
    is_shown = torch.tensor([one.is_shown for one in objects])
    shown[rows[is_shown], columns[is_shown]] = True
    sizes = torch.tensor([frame.size for frame, in_frame in seen for _ in in_frame])
    coverage = cell_coverage(torch.tensor([one.box for one in objects]), sizes, grid)
    cells = _Cells(len(seen), rows, coverage).labels(types, relations, objects)
    return FrameDataset(tuple(seen), tuple(types), tuple(relations), pixels, cells, shown, present)


def _patches(frame: FrameRef, image_processor: Any) -> Tensor:
    pixels: Tensor = image_processor(images=[frame.load()], return_tensors="pt")["pixel_values"]
    if len(pixels) != PATCHES:
        raise DataError(f"{frame.path}: is not square; use square frames")
    return pixels.reshape(PATCHES, 3, 2, -1)[:, :, 0].reshape(PATCHES, -1).half()


def _columns(names: Sequence[Any], chosen: Iterable[Any]) -> Tensor:
    """Return the place of each of the chosen among the names, or -1."""
    places: Mapping[Any, int] = {name: place for place, name in enumerate(names)}
    return torch.tensor([places.get(one, -1) for one in chosen])


@dataclass(frozen=True)
class _Cells:
    """Where the objects of all frames are.

    Attributes:
        n_frames: number of frames.
        rows: each object's frame.
        coverage: the cells that each object is in, (objects, tokens), True or False.
    """

    n_frames: int
    rows: Tensor
    coverage: Tensor

    def labels(
        self,
        types: Sequence[str],
        relations: Sequence[tuple[str, str]],
        objects: Sequence[SeenObject],
    ) -> CellLabels:
        """Return the labels of all cells."""
        columns = _columns(types, (one.type for one in objects))
        is_held = torch.tensor([one.is_held for one in objects])
        is_open = torch.tensor([bool(one.is_open) for one in objects])
        related = _columns(relations, ((one.type, one.parent) for one in objects))
        return CellLabels(
            types=self._mark(columns, len(types)),
            held=self._mark(columns.where(is_held, -1), len(types)),
            opened=self._mark(columns.where(is_open, -1), len(types)),
            related=self._mark(related, len(relations)),
        )

    def _mark(self, columns: Tensor, n_columns: int) -> Tensor:
        """Return labels, (frames, tokens, columns), that are True where objects have the column."""
        marked = torch.zeros(self.n_frames, self.coverage.shape[1], n_columns, dtype=torch.bool)
        which, cells = (self.coverage & (columns >= 0)[:, None]).nonzero(as_tuple=True)
        marked[self.rows[which], cells, columns[which]] = True
        return marked


def cell_coverage(boxes: Tensor, sizes: Tensor, grid: int) -> Tensor:
    """Return the cells of a frame that boxes are in, (boxes, tokens), row by row, as True or False.

    Args:
        boxes: left, top, right and bottom in pixels, both ends inclusive, (boxes, 4).
        sizes: width and height of each box's frame in pixels, (boxes, 2).
        grid: cells along each side.
    """
    left, top, right, bottom = boxes.T
    width, height = sizes.T
    spans = []
    for low, high, extent in ((top, bottom + 1, height), (left, right + 1, width)):
        edges = torch.arange(grid + 1) * (extent[:, None] / grid)
        overlap = torch.minimum(edges[:, 1:], high[:, None]) - torch.maximum(
            edges[:, :-1], low[:, None]
        )
        spans.append(overlap.clamp(min=0) / (extent[:, None] / grid))
    area = (spans[0][:, :, None] * spans[1][:, None, :]).flatten(1)  # in units of cells
    return (area >= _OF_CELL) | (area >= _OF_LARGEST * area.amax(1, keepdim=True))
