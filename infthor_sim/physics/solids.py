"""What of an object is solid: its drawn parts, walls of vessels, the space of its door.

The metadata's box of a sofa has its back and arms, that of a drawer its sides: what is put down
must stay clear of those. So room for things is measured against what is drawn, and the two cannot
disagree.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.objects import DRAWER_SLIDE, SimObject
from infthor_sim.render.primitives import Form, ShapePart
from infthor_sim.render.shapes import shape

Box = tuple[Array, Array]
"""Low and high corner of an axis-aligned box in the world, metres (3,)."""

_VESSELS = frozenset({Form.CUP, Form.BOWL})
_GRIP = 0.03  # metres that the grip of an open door sticks out at its side
_RING = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=1)
_SQUARE = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


@dataclass(frozen=True)
class Wall:
    """The round wall of a vessel, open at its top.

    Attributes:
        center: its middle in the world, metres (3,).
        half: half extents in its own frame, metres (3,).
        axes: its own axes in the world, one a row (3, 3).
        bottom, top: its radii below and above, relative to its half extents.
    """

    center: Array
    half: Array
    axes: Array
    bottom: float
    top: float

    def holds(self, points: Array, outline: Array) -> NDArray[np.bool_]:
        """Return whether a thing fits between the walls at each of some points.

        Args:
            points: middles of its underside, metres (n, 3).
            outline: points of its outline from above, metres from that middle (m, 2).
        """
        spread = np.stack([outline[:, 0], np.zeros(len(outline)), outline[:, 1]], axis=1)
        own = (points[:, None, :] + spread - self.center) @ self.axes.T / self.half
        level = np.clip(own[..., 1], -1.0, 1.0)
        radius = self.bottom + (self.top - self.bottom) * (level + 1) / 2
        return np.asarray((np.hypot(own[..., 0], own[..., 2]) <= radius).all(axis=1))


def part_boxes(item: SimObject, hollow: bool = False) -> list[Box]:
    """Return the boxes around an object's drawn parts; `hollow`: without walls of vessels."""
    return [_box(item, part) for part in shape(item) if not (hollow and part.form in _VESSELS)]


def vessel_walls(item: SimObject) -> list[Wall]:
    """Return the walls of the vessels that an object is drawn of."""
    matrix = item.matrix
    return [
        Wall(item.position + matrix @ np.asarray(part.center, dtype=float),
             np.asarray(part.half, dtype=float),
             (matrix @ _own_matrix(part)).T, part.bottom, part.top)
        for part in shape(item) if part.form == Form.CUP
    ]  # fmt: skip


def outline(item: SimObject) -> Array:
    """Return points around the drawn parts from above, metres from the box's middle (m, 2)."""
    middle = item.center
    corners = []
    for part in shape(item):
        matrix = item.matrix @ _own_matrix(part)
        flat = _SQUARE if part.form == Form.BOX else _RING * max(part.bottom, part.top)
        for level in (-1.0, 1.0):
            own = np.stack(
                [flat[:, 0], np.full(len(flat), level), flat[:, 1]], axis=1
            ) * np.asarray(part.half)
            world = (
                item.position + item.matrix @ np.asarray(part.center, dtype=float) + own @ matrix.T
            )
            corners.append((world - middle)[:, [0, 2]])
    return np.concatenate(corners)


def opening_space(item: SimObject) -> Box | None:
    """Return the box in front of an object that its door or drawer opens into, or None."""
    width, height, depth = item.front_size.tolist()
    if not (item.type.hinged or item.type.slides):
        return None
    reach = width if item.type.hinged else DRAWER_SLIDE * depth
    matrix = item.matrix @ yaw_matrix(item.front)
    middle = item.center + matrix @ np.array([0.0, 0.0, (depth + reach) / 2])
    half = np.abs(matrix) @ np.array([width / 2 + _GRIP, height / 2, reach / 2])
    return middle - half, middle + half


def as_open(item: SimObject, openness: float) -> SimObject:
    """Return a copy of an object that is open so far."""
    return replace(item, state=replace(item.state, openness=openness))


def unfold(item: SimObject, openness: float) -> None:
    """Change an object's box from that at its present openness to that at `openness`.

    It changes for objects without door or drawer: lids rise, flaps spread, blinds come down.
    """
    turn = yaw_matrix(item.front)
    before = item.state.openness
    for way in item.type.unfolds:
        # The axis is given as seen from the front; `step` is its direction in the object's own
        # frame.
        step = turn @ np.eye(3)[way.axis]
        own = int(np.argmax(np.abs(step)))
        size = way.extent(float(item.box_size[own]), before, openness)
        grown = size - item.box_size[own]
        item.box_center = item.box_center - way.stays * grown / 2 * step
        item.box_size = np.where(np.arange(3) == own, size, item.box_size)


def _own_matrix(part: ShapePart) -> Array:
    return np.eye(3) if part.matrix is None else part.matrix


def _box(item: SimObject, part: ShapePart) -> Box:
    matrix = item.matrix
    middle = item.position + matrix @ np.asarray(part.center, dtype=float)
    reach = np.abs(matrix @ _own_matrix(part)) @ np.asarray(part.half, dtype=float)
    return middle - reach, middle + reach
