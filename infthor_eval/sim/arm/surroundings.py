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
_SIDES: Array = np.array([(0, -1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)], dtype=float)  # of a hollow box
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
    shells = _shells(boxes[hollow])
    owners = np.concatenate([owner[~hollow], np.repeat(owner[hollow], len(_SIDES))])
    return Solids(join([boxes[~hollow], shells]), owners, names)


def _stops(world: World, name: str, mass_threshold: float | None) -> bool:
    item = world.objects.get(name)
    if item is None or not item.type.pickupable:
        return True
    return mass_threshold is not None and item.type.mass > mass_threshold and not _goes_along(world, item)


def _goes_along(world: World, item: SimObject) -> bool:
    held = world.carried()
    return item.object_id in held or any(outer.object_id in held for outer in world.ancestors(item))


def _shells(vessels: Boxes) -> Boxes:
    """Floors and sides (n * 5) of hollow boxes (n)."""
    thick = _WALL * vessels.half
    offsets = _SIDES * (vessels.half - thick)[:, None]
    return Boxes(
        vessels.center[:, None] + offsets @ vessels.axes,
        np.repeat(vessels.axes[:, None], len(_SIDES), axis=1),
        np.where(_SIDES != 0, thick[:, None], vessels.half[:, None]),
    ).flat()
