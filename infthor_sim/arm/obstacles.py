"""Obstacles for an arm: the primitives that are drawn, as oriented boxes.

Walls, floors and everything fixed count, and loose objects too heavy to be pushed aside. Other
loose objects give way in Unity; here the arm passes through them.
"""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.arm.boxes import Boxes, join
from infthor_sim.geometry import Array
from infthor_sim.objects import SimObject
from infthor_sim.render.primitives import AXES, CENTER, FORM, HALF, INSTANCE, Form
from infthor_sim.world import World

_WALL = 0.08  # thickness of the sides and the floor of a hollow primitive, as a share of its width
# of a hollow box
_SIDES: Array = np.array([(0, -1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)], dtype=float)
_HOLLOW = (Form.CUP, Form.BOWL)


class ArmObstacles:
    """Boxes that stop an arm.

    Attributes:
        boxes: the boxes (n).
        owner: index of each box's object in `names` (n,).
        names: ids of objects, and names of the parts of the shell.
    """

    def __init__(self, boxes: Boxes, owner: NDArray[np.int64], names: tuple[str, ...]) -> None:
        self.boxes = boxes
        self.owner = owner
        self.names = names
        self._low, self._high = boxes.bounds()

    def near(self, low: Array, high: Array) -> "ArmObstacles":
        """Return those that overlap a region, given by its low and high corner (3,)."""
        near = np.all((self._low < high) & (self._high > low), axis=1)
        return ArmObstacles(self.boxes[near], self.owner[near], self.names)


def arm_obstacles(
    world: World, rows: Array, names: tuple[str, ...], mass_threshold: float | None
) -> ArmObstacles:
    """Return what stops an arm in a world.

    Args:
        rows: the world's primitives (n, COLUMNS), without those of what is held.
        names: ids of objects and names of the parts of the shell, by instance.
        mass_threshold: mass above which a loose object stops the arm, kilograms; None: none does.
    """
    blocking = np.array([_blocks(world, name, mass_threshold) for name in names])
    owner = rows[:, INSTANCE].astype(np.int64)
    kept = blocking[owner]
    rows = rows[kept]
    owner = owner[kept]
    boxes = Boxes(
        rows[:, CENTER : CENTER + 3],
        rows[:, AXES : AXES + 9].reshape(-1, 3, 3),
        rows[:, HALF : HALF + 3],
    )
    # A round primitive stops the arm as its box does. A hollow one would fill its inside so, where
    # the arm must go.
    hollow = np.isin(rows[:, FORM], _HOLLOW)
    shells = _shells(boxes[hollow])
    owners = np.concatenate([owner[~hollow], np.repeat(owner[hollow], len(_SIDES))])
    return ArmObstacles(join([boxes[~hollow], shells]), owners, names)


def _blocks(world: World, name: str, mass_threshold: float | None) -> bool:
    item = world.objects.get(name)
    if item is None or not item.type.pickupable:
        return True
    return (
        mass_threshold is not None
        and item.type.mass > mass_threshold
        and not _is_carried(world, item)
    )


def _is_carried(world: World, item: SimObject) -> bool:
    """Return whether the agent holds the object or something that contains it."""
    held = world.held_ids()
    return item.object_id in held or any(outer.object_id in held for outer in world.ancestors(item))


def _shells(vessels: Boxes) -> Boxes:
    """Return floors and sides (n * 5) of hollow boxes (n)."""
    thick = _WALL * vessels.half
    offsets = _SIDES * (vessels.half - thick)[:, None]
    return Boxes(
        vessels.center[:, None] + offsets @ vessels.axes,
        np.repeat(vessels.axes[:, None], len(_SIDES), axis=1),
        np.where(_SIDES != 0, thick[:, None], vessels.half[:, None]),
    ).flat()
