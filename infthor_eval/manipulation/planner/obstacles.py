"""Obstacles of an arm, as far as the metadata tell: boxes along the world's axes."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.geometry import Corners, corners_of
from infthor_eval.manipulation.planner.linkage import Array, Parts
from infthor_eval.manipulation.planner.places import Entry, Places
from infthor_eval.thor.view import ThorObject

_BOARD = 0.02  # metres: half the thickness of walls and boards of furniture
_LEAF = 0.04  # metres: thickness of a door, with what is on its inner side
_PIECES = 5  # boxes of an open door, which is not along an axis
_LEAN = 0.1  # share of its width by which the free edge of an open door leans over the opening
_FAR = 0.05  # metres from the arm beyond which the exact distance of a box does not matter
_LATTICE = 1.05  # maximum distance of neighbours in a row, in units of the places' spacing
_TURNED = 4.0  # ratio of squared rows to points above which a lattice is not along the axes
_THIN = 0.1  # metres from places to their box's top within which the box is filled to its top


@dataclass(frozen=True)
class Obstacles:
    """Boxes along the world's axes.

    Attributes:
        center: centres, metres (n, 3).
        half: half extents (n, 3).
        names: ids of the things that they belong to; the boxes of one thing are consecutive.
    """

    center: Array
    half: Array
    names: tuple[str, ...]

    def things(self) -> NDArray[np.int64]:
        """Return the number of the thing that each box (n,) belongs to, from 0 on."""
        changes = [
            number > 0 and name != self.names[number - 1] for number, name in enumerate(self.names)
        ]
        return np.cumsum(np.array(changes, dtype=np.int64))


def obstacles_of(boxes: Iterable[tuple[str, Corners]]) -> Obstacles:
    """Return boxes as obstacles, each with the id of its thing."""
    listed = list(boxes)
    low = np.array([box.low for _, box in listed]).reshape(-1, 3)
    high = np.array([box.high for _, box in listed]).reshape(-1, 3)
    return Obstacles((low + high) / 2, (high - low) / 2, tuple(name for name, _ in listed))


def clearances(parts: Parts, obstacles: Obstacles) -> Array:
    """Return how far (n, m, things) parts (n, m) are from things, metres; overlaps are negative.

    Things that are far from all parts are at infinity. This is the separating axis test without the
    directions at right angles to two edges: that saves nine of fifteen axes, and edges that pass
    each other closely count as a collision.
    """
    things = obstacles.things()
    n_things = int(things[-1]) + 1 if len(things) else 0
    clearance = np.full((*parts.center.shape[:2], n_things), np.inf)
    extent = (np.abs(parts.axes) * parts.half[..., None]).sum(axis=-2)
    low = (parts.center - extent).min(axis=(0, 1))
    high = (parts.center + extent).max(axis=(0, 1))
    is_below = obstacles.center - obstacles.half < high + _FAR
    is_above = obstacles.center + obstacles.half > low - _FAR
    near = (is_below & is_above).all(axis=1)
    if near.any():
        owners, firsts = np.unique(things[near], return_index=True)
        to_boxes = _separations(parts, extent, obstacles.center[near], obstacles.half[near])
        clearance[:, :, owners] = np.minimum.reduceat(to_boxes, firsts, axis=-1)
    return clearance


def _separations(parts: Parts, extent: Array, center: Array, half: Array) -> Array:
    """Return separations (n, m, k) of oriented boxes (n, m), extents (n, m, 3), from boxes (k)."""
    between = center - parts.center[:, :, None]
    along_world = (np.abs(between) - half - extent[:, :, None]).max(axis=-1)
    turned = parts.axes.transpose(0, 1, 3, 2)
    reach = parts.half[:, :, None] + half @ np.abs(turned)
    separations: Array = np.maximum(along_world, (np.abs(between @ turned) - reach).max(axis=-1))
    return separations


def columns(furniture: ThorObject, places: Places) -> list[Corners]:
    """Return boxes below furniture's places; its own box may be partly empty (a corner counter)."""
    box = corners_of(furniture)
    boxes = []
    for height in places.heights:
        bottom, top = min(box.low[1], height - _BOARD), height
        if box.high[1] - height < _THIN:
            top = max(height, box.high[1])
        for low, high in _rectangles(places.level(height), places.spacing):
            boxes.append(Corners((low[0], bottom, low[1]), (high[0], top, high[1])))
    return boxes


_Span = tuple[float, float]


def _rectangles(points: Array, spacing: float) -> list[tuple[_Span, _Span]]:
    """Return rectangles, by their lowest and highest x and z, around lattices of points (n, 3).

    Adjacent rows of equal length are one rectangle. A lattice that is not along the axes gets a
    single one.
    """
    rows: dict[float, list[float]] = {}
    for x, _, z in np.round(points, 3).tolist():
        rows.setdefault(x, []).append(z)
    if len(rows) ** 2 > _TURNED * len(points) * _ratio(points):
        xs = float(points[:, 0].min()), float(points[:, 0].max())
        zs = float(points[:, 2].min()), float(points[:, 2].max())
        return [_rectangle_around(xs, zs, spacing)]
    closed: list[tuple[_Span, _Span]] = []
    # The first and last x of rows that reach from one z to another.
    growing: dict[_Span, _Span] = {}
    for x in sorted(rows):
        for run in _runs(sorted(rows[x]), spacing):
            first, last = growing.get(run, (x, x))
            if x - last > spacing * _LATTICE:
                closed.append(_rectangle_around((first, last), run, spacing))
                first = x
            growing[run] = (first, x)
    return [*closed, *(_rectangle_around(span, run, spacing) for run, span in growing.items())]


def _rectangle_around(xs: _Span, zs: _Span, spacing: float) -> tuple[_Span, _Span]:
    """Return the rectangle around points: its low and its high corner."""
    half = spacing / 2
    return (xs[0] - half, zs[0] - half), (xs[1] + half, zs[1] + half)


def _ratio(points: Array) -> float:
    """Return the ratio of the points' longer extent to their shorter one."""
    size = np.ptp(points[:, [0, 2]], axis=0) + 1e-3
    return float(size.max() / size.min())


def _runs(values: Sequence[float], spacing: float) -> list[_Span]:
    """Return the first and last of each unbroken row of values."""
    runs: list[_Span] = []
    first = last = values[0]
    for value in values[1:]:
        if value - last > spacing * _LATTICE:
            runs.append((first, last))
            first = value
        last = value
    return [*runs, (first, last)]


def cavity(receptacle: ThorObject, places: Places, entry: Entry, hinge: int) -> list[Corners]:
    """Return boxes of a receptacle entered from the front: sides, back, top, boards, open door.

    Args:
        hinge: edge of the opening that the door hangs on: -1 for the one of lower coordinate, 1 for
            the other, 0 for no door.
    """
    box = corners_of(receptacle)
    half = places.spacing / 2
    axis = entry.axis
    across = 2 - entry.axis
    low = places.points.min(axis=0) - half
    high = places.points.max(axis=0) + half
    inner = Corners((low[0], box.low[1], low[2]), (high[0], box.high[1], high[2]))
    boxes = [_slab(inner, across, side, 2 * _BOARD) for side in (-1, 1)]
    boxes.append(_slab(inner, axis, -entry.sign, 2 * _BOARD))
    if places.is_roofed(places.heights[-1]):
        roof = box.high[1]
        boxes.append(Corners((low[0], roof - _BOARD, low[2]), (high[0], roof, high[2])))
    for height in places.heights:
        boxes.append(Corners((low[0], height - 2 * _BOARD, low[2]), (high[0], height, high[2])))
    leaf = (box.high if entry.sign > 0 else box.low)[axis], entry.position
    if hinge and abs(leaf[0] - leaf[1]) > _LEAF:
        boxes += _leaf(inner, entry, hinge, leaf[0])
    return boxes


def _slab(inner: Corners, axis: int, side: int, thick: float) -> Corners:
    """Return a wall outside one side of a box."""
    low, high = list(inner.low), list(inner.high)
    edge = (inner.high if side > 0 else inner.low)[axis]
    low[axis], high[axis] = sorted((edge, edge + side * thick))
    return Corners((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def _leaf(inner: Corners, entry: Entry, hinge: int, end: float) -> list[Corners]:
    """Return an open door in pieces, outer ones more over the opening: it stops short of 90°."""
    across = 2 - entry.axis
    width = inner.high[across] - inner.low[across]
    edge = (inner.high if hinge > 0 else inner.low)[across]
    stops = np.linspace(entry.position, end, _PIECES + 1).tolist()
    pieces = []
    for number, (start, stop) in enumerate(itertools.pairwise(stops)):
        middle = edge + hinge * _BOARD - hinge * _LEAN * width * (number + 0.5) / _PIECES
        low, high = list(inner.low), list(inner.high)
        low[entry.axis], high[entry.axis] = sorted((start, stop))
        low[across], high[across] = sorted((middle + hinge * _LEAF / 2, middle - hinge * _LEAF))
        pieces.append(Corners((low[0], low[1], low[2]), (high[0], high[1], high[2])))
    return pieces
