"""What an arm can run into: the shapes that are drawn, as turned boxes.

Walls, floors and all that stands for good count, as do things too heavy to be pushed aside. Loose things give way in
Unity; here the arm passes through them.
"""

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.arm.boxes import Boxes, join
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.render.primitives import AXES, CENTER, FORM, HALF, INSTANCE, Form
from infthor_eval.sim.world import World

__all__ = ["Solids", "solids"]

_WALL = 0.08  # thickness of the sides and the floor of a hollow shape, as a share of its width
_HOLLOW = (Form.CUP, Form.BOWL)


class Solids:
    """Boxes that stop an arm.

    Attributes:
        boxes: the boxes (n).
        owner: index into `names` of each (n,).
        names: ids of objects, or names of walls and the like.
    """

    def __init__(self, boxes: Boxes, owner: NDArray[np.int64], names: tuple[str, ...]) -> None:
        self.boxes, self.owner, self.names = boxes, owner, names
        self._low, self._high = boxes.bounds()

    def near(self, low: Array, high: Array) -> "Solids":
        """Those that a region, given by its low and high corner (3,), meets."""
        met = np.all((self._low < high) & (self._high > low), axis=1)
        return Solids(self.boxes[met], self.owner[met], self.names)


def solids(world: World, rows: Array, names: tuple[str, ...], mass_threshold: float | None) -> Solids:
    """What stops an arm in a world.

    Args:
        world: the world.
        rows: all that is drawn of it (n, COLUMNS), without what is held.
        names: ids of objects and names of walls and the like, by instance.
        mass_threshold: kilograms above which a loose thing stops the arm too; None: none does.
    """
    stopping = np.array([_stops(world, name, mass_threshold) for name in names])
    owner = rows[:, INSTANCE].astype(np.int64)
    kept = stopping[owner]
    rows, owner = rows[kept], owner[kept]
    boxes = Boxes(rows[:, CENTER : CENTER + 3], rows[:, AXES : AXES + 9].reshape(-1, 3, 3), rows[:, HALF : HALF + 3])
    hollow = np.isin(rows[:, FORM], _HOLLOW)
    shells = [_shell(boxes[hollow][index : index + 1]) for index in range(int(hollow.sum()))]
    parts = [boxes[~hollow], *shells]
    owners = [owner[~hollow], *(np.full(len(s), o) for s, o in zip(shells, owner[hollow], strict=True))]
    return Solids(join(parts), np.concatenate(owners), names)


def _stops(world: World, name: str, mass_threshold: float | None) -> bool:
    item = world.objects.get(name)
    if item is None or not item.type.pickupable:
        return True
    return mass_threshold is not None and item.type.mass > mass_threshold and not _goes_along(world, item)


def _goes_along(world: World, item: SimObject) -> bool:
    held = world.carried()
    return item.object_id in held or any(outer.object_id in held for outer in world.ancestors(item))


def _shell(vessel: Boxes) -> Boxes:
    """Floor and four sides of a hollow box (1)."""
    center, axes, half = vessel.center[0], vessel.axes[0], vessel.half[0]
    thick = _WALL * half
    floor = (np.array([0.0, -half[1] + thick[1], 0.0]), np.array([half[0], thick[1], half[2]]))
    sides = [
        (np.eye(3)[axis] * sign * (half[axis] - thick[axis]), np.where(np.arange(3) == axis, thick, half))
        for axis in (0, 2)
        for sign in (-1.0, 1.0)
    ]
    offsets, halves = (np.stack(part) for part in zip(floor, *sides, strict=True))
    return Boxes(center + offsets @ axes, np.repeat(axes[None], 5, axis=0), halves)
