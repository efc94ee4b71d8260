"""Units of recorded frames as a tower without mistakes would see them.

What to compare with what is learned in minutes from what frames do show, and not in hours from what
a tower tells of them. So the decoder reads labels first.
"""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from recipes.nano.reading.frame_units import FrameUnits
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seen_objects import SeenFrame, SeenObject

# A box is in a token's part of the picture if it has so large a share of the part, or of what it
# has in the part with most of it.
_OF_TOKEN = 0.4
_OF_LARGEST = 0.5
_LEAST_AREA = 60  # pixels of a box
# Units before their nonlinearity: off, and the range of those that are on.
_OFF = -9.0
_ON = (2.4, 4.0)


def label_units(
    seen: Sequence[SeenFrame], units: Units, loose: NDArray[np.bool_], grid: int, seed: int
) -> FrameUnits:
    """Return the units of frames by what they show.

    Args:
        seen: the frames, each once, with what they show.
        units: names of the units.
        loose: [types], True for the types of things that can be picked up.
        grid: tokens along each side of a frame.
        seed: seed of how much each unit is on.
    """
    shown = [
        (at, one)
        for at, (_, objects) in enumerate(seen)
        for one in objects
        if units.index(one.type) >= 0 and _area(one) >= _LEAST_AREA
    ]
    frame = np.array([at for at, _ in shown], np.int64)
    sizes = np.array([one.frame.size for one in seen], float).reshape(-1, 2)
    boxes = np.array([one.box for _, one in shown], float).reshape(-1, 4)
    is_in = _tokens(boxes, sizes[frame], grid)
    values = np.full((len(seen), grid**2, len(Role), len(units.types)), _OFF, np.float16)
    rng = np.random.default_rng(seed)
    for role, of_role in _types_by_role([one for _, one in shown], units, loose).items():
        thing, token = np.nonzero(is_in & (of_role >= 0)[:, None])
        values[frame[thing], token, role, of_role[thing]] = rng.uniform(*_ON, len(thing))
    places = {one.frame.digest: at for at, one in enumerate(seen)}
    return FrameUnits(torch.from_numpy(values), places)


def _area(one: SeenObject) -> int:
    left, top, right, bottom = one.box
    return (right - left + 1) * (bottom - top + 1)


def _types_by_role(
    objects: Sequence[SeenObject], units: Units, loose: NDArray[np.bool_]
) -> dict[Role, NDArray[np.int64]]:
    """Return for each role the index of the type that each object turns on in it, or -1."""
    own = np.array([units.index(one.type) for one in objects], np.int64)
    parent = np.array([units.index(one.parent) if one.parent else -1 for one in objects], np.int64)
    is_held = np.array([one.is_held for one in objects], bool)
    is_open = np.array([bool(one.is_open) for one in objects], bool)
    return {
        Role.SHOWN: own,
        Role.HELD: np.where(is_held, own, -1),
        Role.OPEN: np.where(is_open, own, -1),
        Role.AROUND: np.where(loose[own] & ~is_held, parent, -1),
    }


def _tokens(boxes: NDArray[np.float64], sizes: NDArray[np.float64], grid: int) -> NDArray[np.bool_]:
    """Return which tokens boxes are in, (boxes, tokens), the tokens row by row.

    Args:
        boxes: left, top, right and bottom in pixels, both ends inclusive, (boxes, 4).
        sizes: width and height of each box's frame in pixels, (boxes, 2).
        grid: tokens along each side.
    """
    step = (sizes / grid)[:, :, None]
    edges = np.arange(grid + 1) * step  # (boxes, across and down, edges)
    low, high = boxes[:, :2, None], boxes[:, 2:, None] + 1
    overlap = np.minimum(edges[:, :, 1:], high) - np.maximum(edges[:, :, :-1], low)
    columns, rows = (np.clip(overlap, 0, None) / step).swapaxes(0, 1)
    area = (rows[:, :, None] * columns[:, None, :]).reshape(-1, grid**2)  # in parts of a picture
    return (area >= _OF_TOKEN) | (area >= _OF_LARGEST * area.max(1, keepdims=True))
