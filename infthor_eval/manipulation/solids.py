"""What stands in an arm's way, as far as metadata tell: boxes along the world's axes."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.geometry import Corners, corners_of
from infthor_eval.manipulation.linkage import Array, Parts
from infthor_eval.manipulation.places import Entry, Places
from infthor_eval.thor.view import ThorObject

__all__ = ["Solids", "cavity", "columns", "gaps", "solids_of"]

_BOARD = 0.02  # metres: half of what walls and boards of furniture are thick
_LEAF = 0.04  # metres that a door is thick, with what is on its inner side
_PIECES = 5  # in which an open door is told
_LEAN = 0.1  # share of its width by which the free edge of an open door leans over the opening
_FAR = 0.05  # metres between boxes that are not looked at more closely
_LATTICE = 1.05  # of places' distance: neighbours in a row
_TURNED = 4.0  # a lattice has more rows, as their number's square by that of its points, if it is turned
_THIN = 0.1  # metres: a board reaches from its places to the top of its box


@dataclass(frozen=True)
class Solids:
    """Boxes along the world's axes.

    Attributes:
        center: metres (n, 3).
        half: half extents (n, 3).
        names: ids of what they belong to; boxes of one thing are neighbours.
    """

    center: Array
    half: Array
    names: tuple[str, ...]

    def things(self) -> NDArray[np.int64]:
        """Which thing each box (n,) belongs to, counted from 0 on."""
        changes = [number > 0 and name != self.names[number - 1] for number, name in enumerate(self.names)]
        return np.cumsum(np.array(changes, dtype=np.int64))


def solids_of(boxes: Iterable[tuple[str, Corners]]) -> Solids:
    """Boxes, each with the id of its owner."""
    listed = list(boxes)
    low = np.array([box.low for _, box in listed]).reshape(-1, 3)
    high = np.array([box.high for _, box in listed]).reshape(-1, 3)
    return Solids((low + high) / 2, (high - low) / 2, tuple(name for name, _ in listed))


def gaps(parts: Parts, solids: Solids) -> Array:
    """How far (n, m, things) parts (n, m) are from things, metres; below zero: how deep in them.

    Things that are far from all parts are at infinity. Directions at right angles to two edges are left out, so that a
    corner that passes another counts as met.
    """
    things = solids.things()
    found = np.full((*parts.center.shape[:2], int(things[-1]) + 1 if len(things) else 0), np.inf)
    extent = (np.abs(parts.axes) * parts.half[..., None]).sum(axis=-2)
    low, high = (parts.center - extent).min(axis=(0, 1)), (parts.center + extent).max(axis=(0, 1))
    near = ((solids.center - solids.half < high + _FAR) & (solids.center + solids.half > low - _FAR)).all(axis=1)
    if near.any():
        owners, firsts = np.unique(things[near], return_index=True)
        to_boxes = _apart(parts, extent, solids.center[near], solids.half[near])
        found[:, :, owners] = np.minimum.reduceat(to_boxes, firsts, axis=-1)
    return found


def _apart(parts: Parts, extent: Array, center: Array, half: Array) -> Array:
    """Gaps (n, m, k) between turned boxes (n, m), which reach so far (n, m, 3), and boxes along the axes (k)."""
    between = center - parts.center[:, :, None]
    along_world = (np.abs(between) - half - extent[:, :, None]).max(axis=-1)
    turned = parts.axes.transpose(0, 1, 3, 2)
    reach = parts.half[:, :, None] + half @ np.abs(turned)
    found: Array = np.maximum(along_world, (np.abs(between @ turned) - reach).max(axis=-1))
    return found


def columns(item: ThorObject, places: Places) -> list[Corners]:
    """What is below the places of a piece of furniture: its box may have room within, as that of a corner counter."""
    box = corners_of(item)
    made = []
    for height in places.heights:
        bottom, top = min(box.low[1], height - _BOARD), height
        if box.high[1] - height < _THIN:
            top = max(height, box.high[1])
        for low, high in _rectangles(places.level(height), places.spacing):
            made.append(Corners((low[0], bottom, low[1]), (high[0], top, high[1])))
    return made


_Span = tuple[float, float]


def _rectangles(points: Array, spacing: float) -> list[tuple[_Span, _Span]]:
    """Rectangles, by their lowest and highest x and z, around lattices of points (n, 3).

    Rows that lie beside each other and are of equal length are one. Around a lattice that is turned there is one.
    """
    rows: dict[float, list[float]] = {}
    for x, _, z in np.round(points, 3).tolist():
        rows.setdefault(x, []).append(z)
    if len(rows) ** 2 > _TURNED * len(points) * _ratio(points):
        low, high = points.min(axis=0), points.max(axis=0)
        return [_widened((float(low[0]), float(high[0])), (float(low[2]), float(high[2])), spacing)]
    closed: list[tuple[_Span, _Span]] = []
    growing: dict[_Span, _Span] = {}  # the first and last x of rows that reach from one z to another
    for x in sorted(rows):
        for run in _runs(sorted(rows[x]), spacing):
            first, last = growing.get(run, (x, x))
            if x - last > spacing * _LATTICE:
                closed.append(_widened((first, last), run, spacing))
                first = x
            growing[run] = (first, x)
    return [*closed, *(_widened(span, run, spacing) for run, span in growing.items())]


def _widened(xs: _Span, zs: _Span, spacing: float) -> tuple[_Span, _Span]:
    """The rectangle around points: its low and its high corner."""
    half = spacing / 2
    return (xs[0] - half, zs[0] - half), (xs[1] + half, zs[1] + half)


def _ratio(points: Array) -> float:
    """How much longer the points reach along one axis than along the other."""
    size = np.ptp(points[:, [0, 2]], axis=0) + 1e-3
    return float(size.max() / size.min())


def _runs(values: Sequence[float], spacing: float) -> list[_Span]:
    """First and last of each unbroken row of values."""
    found: list[_Span] = []
    first = last = values[0]
    for value in values[1:]:
        if value - last > spacing * _LATTICE:
            found.append((first, last))
            first = value
        last = value
    return [*found, (first, last)]


def cavity(item: ThorObject, places: Places, entry: Entry, hinge: int) -> list[Corners]:
    """What something that is entered from the front is made of: sides, back, top, boards, and its open door.

    Args:
        item: the receptacle.
        places: in it.
        entry: its opening.
        hinge: -1 or 1, the edge of the opening that the door hangs on, as its coordinate goes; 0: it has none.
    """
    box, half = corners_of(item), places.spacing / 2
    axis, across = entry.axis, 2 - entry.axis
    low, high = places.points.min(axis=0) - half, places.points.max(axis=0) + half
    inner = Corners((low[0], box.low[1], low[2]), (high[0], box.high[1], high[2]))
    made = [_slab(inner, across, side, 2 * _BOARD) for side in (-1, 1)]
    made.append(_slab(inner, axis, -entry.sign, 2 * _BOARD))
    if places.is_roofed(places.heights[-1]):
        made.append(Corners((low[0], box.high[1] - _BOARD, low[2]), (high[0], box.high[1], high[2])))
    for height in places.heights:
        made.append(Corners((low[0], height - 2 * _BOARD, low[2]), (high[0], height, high[2])))
    leaf = (box.high if entry.sign > 0 else box.low)[axis], entry.position
    if hinge and abs(leaf[0] - leaf[1]) > _LEAF:
        made += _leaf(inner, entry, hinge, leaf[0])
    return made


def _slab(inner: Corners, axis: int, side: int, thick: float) -> Corners:
    """A wall outside one side of a box."""
    low, high = list(inner.low), list(inner.high)
    edge = (inner.high if side > 0 else inner.low)[axis]
    low[axis], high[axis] = sorted((edge, edge + side * thick))
    return Corners((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def _leaf(inner: Corners, entry: Entry, hinge: int, end: float) -> list[Corners]:
    """An open door in pieces, those farther out more over the opening: doors stop short of a right angle."""
    across = 2 - entry.axis
    width = inner.high[across] - inner.low[across]
    edge = (inner.high if hinge > 0 else inner.low)[across]
    stops = np.linspace(entry.position, end, _PIECES + 1).tolist()
    made = []
    for number, (start, stop) in enumerate(itertools.pairwise(stops)):
        middle = edge + hinge * _BOARD - hinge * _LEAN * width * (number + 0.5) / _PIECES
        low, high = list(inner.low), list(inner.high)
        low[entry.axis], high[entry.axis] = sorted((start, stop))
        low[across], high[across] = sorted((middle + hinge * _LEAF / 2, middle - hinge * _LEAF))
        made.append(Corners((low[0], low[1], low[2]), (high[0], high[1], high[2])))
    return made
