"""Labelled views in memory, and batches of crops and of whole frames of them.

A crop is as large as a token's part of a frame, around something: a sixteenth of a frame's cost, in
which something is to be learned. Frames are mostly floor and walls.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import DataError
from infthor_eval.storage.digests import digest_of_files
from recipes.nano.seeing.units import Units
from recipes.nano.views.labelled_views import LabelledViews, read_views

_Scalar = TypeVar("_Scalar", bound=np.generic)
_RENDERED_SIDE = 300  # pixels of the frames that labels are of
_LEAST_PIXELS = 80  # of something that a crop is taken around
_FLOOR = "Floor"  # what lies there is in no receptacle that anybody would name
_FIXTURE_SHARE = 0.04  # weight of a crop around a fixture, of the mean weight around loose things
_SMALL_PIXELS = 200  # what has less is taken half as often
_SMALL_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class ViewBatch:
    """Crops or frames, with the things in them.

    Attributes:
        patches: uint8, [pictures, cells, values], blocks of a token's cells after each other.
        picture: [things], the picture that shows a thing.
        type: [things], index of its type.
        receptacle: [things], index of the type of its receptacle, or -1.
        loose: [things], True if it can be picked up.
        held: [things], True if it is in the hand.
        opened: [things], True if it is open.
        n_pixels: [things], its pixels in the whole frame.
        pixels: [things, cells], its pixels in each cell of the picture, in the order of `patches`.
    """

    patches: NDArray[np.uint8]
    picture: NDArray[np.int64]
    type: NDArray[np.int64]
    receptacle: NDArray[np.int64]
    loose: NDArray[np.bool_]
    held: NDArray[np.bool_]
    opened: NDArray[np.bool_]
    n_pixels: NDArray[np.int64]
    pixels: NDArray[np.int64]


def in_merge_order(cells: NDArray[_Scalar], block: int) -> NDArray[_Scalar]:
    """Return cells, [n, side, side, ...], as [n, cells, ...], blocks of `block` squared together,
    as Qwen2.5-VL's merger takes them."""
    n, side, _, *rest = cells.shape
    blocks = side // block
    grouped = cells.reshape(n, blocks, block, blocks, block, *rest).swapaxes(2, 3)
    return grouped.reshape(n, side * side, *rest)


class ViewDataset:
    """All views of some files.

    Args:
        paths: files of labelled views; they have the same sizes.
        block: cells along each side of a token's part of a frame.

    Attributes:
        units: units of the types in the views.
        loose: [types], True for the types of things that can be picked up.
        fixtures: [types], True for the types of all others that hold something or can be opened.
    """

    def __init__(self, paths: Sequence[Path], block: int) -> None:
        rooms = [read_views(path) for path in paths]
        if not rooms:
            raise DataError("no labelled views to learn from; generate some")
        self._block = block
        self._grid = _common_grid(rooms, paths)
        self._paths = paths
        self.units = Units(name for room in rooms for name in room.names.tolist())
        self._starts = starts = np.cumsum([0, *(len(room.frames) for room in rooms)])
        self._frames = [room.frames for room in rooms]
        self._view = np.concatenate(
            [room.view + start for room, start in zip(rooms, starts[:-1], strict=True)]
        )
        order = np.argsort(self._view, kind="stable")
        self._view = self._view[order]
        self._type = self._indices(rooms, "type")[order]
        self._receptacle = self._indices(rooms, "receptacle")[order]
        self._loose, self._held, self._opened, self._pixels = (
            np.concatenate([getattr(room, name) for room in rooms])[order]
            for name in ("loose", "held", "opened", "pixels")
        )
        self._first = np.searchsorted(self._view, np.arange(starts[-1] + 1))
        self._n_pixels = self._pixels.sum((1, 2), dtype=np.int64)
        self.loose = np.zeros(len(self.units.types), bool)
        self.loose[self._type[self._loose]] = True
        self.fixtures = self._find_fixtures()
        self._centres, self._chances = self._crop_centres()

    def __len__(self) -> int:
        """Return the number of views."""
        return int(self._starts[-1])

    @property
    def cell_pixels(self) -> int:
        """Pixels of a cell of a frame as it was rendered."""
        return (_RENDERED_SIDE // self._grid) ** 2

    @property
    def crop_patches(self) -> int:
        """Patches of a crop."""
        return self._block**2

    @property
    def frame_patches(self) -> int:
        """Patches of a frame."""
        return self._grid**2

    def identity(self) -> str:
        """Return a hash of all views and labels."""
        return digest_of_files(self._paths)

    def _find_fixtures(self) -> NDArray[np.bool_]:
        is_fixture = np.zeros(len(self.units.types), bool)
        is_fixture[self._receptacle[self._receptacle >= 0]] = True
        is_fixture[self._type[self._opened]] = True
        floor = self.units.index(_FLOOR)
        if floor >= 0:
            is_fixture[floor] = False
        return is_fixture & ~self.loose

    def _indices(self, rooms: Iterable[LabelledViews], column: str) -> NDArray[np.int64]:
        parts = []
        for room in rooms:
            # the last one is for -1, none
            index = np.array([*map(self.units.index, room.names.tolist()), -1])
            parts.append(index[getattr(room, column)])
        return np.concatenate(parts)

    def _crop_centres(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the things that crops are taken around, and their cumulated chances.

        Rare types are as good to know as frequent ones.
        """
        is_centre = (self._n_pixels >= _LEAST_PIXELS) & ~self._held
        is_loose = is_centre & self._loose
        counts = np.bincount(self._type[is_loose], minlength=len(self.units.types))
        rarity = 1 / np.sqrt(np.maximum(counts, 1))
        fixture = _FIXTURE_SHARE * rarity[self.loose].mean()
        weights = np.where(is_loose, rarity[self._type], fixture)
        weights *= np.where(self._n_pixels >= _SMALL_PIXELS, 1, _SMALL_SHARE)
        (centres,) = np.nonzero(is_centre)
        if not len(centres):
            raise DataError("labelled views show nothing large enough; generate more")
        chances = np.cumsum(weights[centres])
        return centres, chances / chances[-1]

    def frames(self, views: NDArray[np.int64], mirrored: NDArray[np.bool_]) -> ViewBatch:
        """Return whole frames, some of them mirrored left to right."""
        corners = np.zeros(len(views), np.int64)
        return self._batch(views, corners, corners, self._grid, mirrored)

    def crops(self, n: int, rng: np.random.Generator) -> ViewBatch:
        """Return crops around random things, half of them mirrored."""
        centres = self._centres[np.searchsorted(self._chances, rng.random(n))]
        cells = self._pixels[centres].reshape(n, -1).argmax(1)
        limit = self._grid - self._block
        top, left = (
            np.clip(place - rng.integers(0, self._block, n), 0, limit)
            for place in np.divmod(cells, self._grid)
        )
        return self._batch(self._view[centres], top, left, self._block, rng.random(n) < 0.5)

    def random_frames(self, n: int, rng: np.random.Generator) -> ViewBatch:
        """Return random whole frames, half of them mirrored."""
        return self.frames(rng.integers(0, len(self), n), rng.random(n) < 0.5)

    def _patches(self, view: int) -> NDArray[np.uint8]:
        """Return the patches of a frame, [grid, grid, values]."""
        room = int(np.searchsorted(self._starts, view, side="right")) - 1
        frame = self._frames[room][view - self._starts[room]]
        side = len(frame) // self._grid
        cut = frame.reshape(self._grid, side, self._grid, side, 3).swapaxes(1, 2)
        return cut.reshape(self._grid, self._grid, -1)

    def _batch(
        self,
        views: NDArray[np.int64],
        top: NDArray[np.int64],
        left: NDArray[np.int64],
        side: int,
        mirrored: NDArray[np.bool_],
    ) -> ViewBatch:
        rows = top[:, None] + np.arange(side)
        columns = left[:, None] + np.arange(side)
        columns[mirrored] = columns[mirrored, ::-1]
        patches = np.stack(
            [
                self._patches(view)[own_rows[:, None], own_columns]
                for view, own_rows, own_columns in zip(views, rows, columns, strict=True)
            ]
        )
        patches[mirrored] = _mirrored(patches[mirrored])
        things = [np.arange(*self._first[view : view + 2]) for view in views]
        picture = np.repeat(np.arange(len(views)), [len(one) for one in things])
        thing = np.concatenate(things)
        pixels = self._pixels[
            thing[:, None, None], rows[picture][:, :, None], columns[picture][:, None, :]
        ].astype(np.int64)
        seen = pixels.any((1, 2))
        thing, picture, pixels = thing[seen], picture[seen], pixels[seen]
        return ViewBatch(
            patches=in_merge_order(patches, self._block),
            picture=picture,
            type=self._type[thing],
            receptacle=self._receptacle[thing],
            loose=self._loose[thing],
            held=self._held[thing],
            opened=self._opened[thing],
            n_pixels=self._n_pixels[thing],
            pixels=in_merge_order(pixels, self._block),
        )


def _common_grid(rooms: Sequence[LabelledViews], paths: Sequence[Path]) -> int:
    """Return the cells along each side, which all rooms have in common with the size of frames."""
    shapes = [(room.frames.shape[1:], room.pixels.shape[1:]) for room in rooms]
    for path, shape in zip(paths, shapes, strict=True):
        if shape != shapes[0]:
            raise DataError(f"{path}: its views have another size; generate all with one recipe")
    return int(shapes[0][1][0])


def _mirrored(patches: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return patches, [..., values], each mirrored left to right."""
    side = int((patches.shape[-1] // 3) ** 0.5)
    return patches.reshape(*patches.shape[:-1], side, side, 3)[..., ::-1, :].reshape(patches.shape)
