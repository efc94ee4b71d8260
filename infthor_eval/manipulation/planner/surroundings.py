"""The surroundings of an agent that puts an object down, and beliefs about obstacles in them."""

import math
from enum import IntEnum

import numpy as np

from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.geometry import Corners, Point, corners_of
from infthor_eval.manipulation.planner.linkage import Linkage, Parts
from infthor_eval.manipulation.planner.obstacles import (
    Obstacles,
    cavity,
    clearances,
    columns,
    obstacles_of,
)
from infthor_eval.manipulation.planner.places import (
    Entry,
    Places,
    entry_of,
    is_entered,
    others_on,
    places_of,
)
from infthor_eval.thor.view import ThorObject

_REACH = 1.5  # metres from the wrist within which things are obstacles
_FLOOR_EXTENT = 3.0  # metres of the floor to each side
_SUNK = 0.02  # metres that places may be inside a box that they are only beside
_UNEXPLAINED = 0.03  # metres from all known boxes: a collision there is with something else
_ASIDE = 0.25  # of an opening's width: an origin so far from its middle is at the hinge
# Doors that hang on the left; others hang on the right, if their origin does not tell.
_LEFT = {"Microwave"}

_Boxes = list[tuple[str, Corners]]


class Belief(IntEnum):
    """The boxes that count as obstacles: metadata do not show which furniture is partly empty."""

    NOTHING = 0
    RECEPTACLE = 1  # the parts of the receptacle that the object is to be put into
    COLLIDED = 2  # also the whole boxes of things that the arm collided with
    FILLED = 3  # also the parts of all furniture below its places
    WHOLE = 4  # the whole boxes of all furniture, except those that the arm is in


class Surroundings:
    """Obstacles around an agent.

    Attributes:
        places: places of the receptacle; None if it has none.
        entry: its opening; None if it is not entered from the front.
    """

    def __init__(self, environment: ArmEnvironment, linkage: Linkage, floor: float) -> None:
        """Collect the boxes around a reset environment; `floor` is a height in metres."""
        self._environment = environment
        self._linkage = linkage
        self._receptacle_object = environment.view.objects[str(environment.start.receptacle_id)]
        self.places = places_of(environment, self._receptacle_object)
        self.entry: Entry | None = None
        if self.places is not None:
            self.entry = entry_of(environment.view, self._receptacle_object, self.places)
        self._hinges = _hinges(self._receptacle_object, self.places, self.entry)
        # Collisions that each side of the door cannot explain.
        self._n_refuted = [0] * len(self._hinges)
        x, _, z = linkage.shoulder.tolist()
        self._floor = Corners(
            (x - _FLOOR_EXTENT, floor - 1.0, z - _FLOOR_EXTENT),
            (x + _FLOOR_EXTENT, floor, z + _FLOOR_EXTENT),
        )
        self._collided: set[str] = set()
        self._around = {
            belief: self._boxes_around(belief) for belief in (Belief.FILLED, Belief.WHOLE)
        }

    def obstacles(self, belief: Belief) -> Obstacles:
        """Return the obstacles of a belief, with the door on the side that was refuted least."""
        if belief == Belief.NOTHING:
            return obstacles_of(())
        hinge = self._hinges[self._n_refuted.index(min(self._n_refuted))]
        around = self._around.get(belief, [])
        if belief == Belief.COLLIDED:
            around = [
                (name, box) for name, box in self._around[Belief.WHOLE] if name in self._collided
            ]
        return obstacles_of([*self._receptacle(hinge), *around])

    def others(self) -> list[Corners]:
        """Return boxes that may be on the receptacle's places or cover them, loose or furniture."""
        loose = others_on(
            self._environment.view, self._receptacle_object, self._environment.start.object_id
        )
        return [*map(corners_of, loose), *(box for _, box in self._around[Belief.FILLED])]

    def add_collision(self, parts: Parts, error: str) -> bool:
        """Take a collision; with the receptacle it counts against sides of the door it refutes.

        Args:
            parts: parts of the arm in the colliding pose (1).

        Returns:
            Whether the arm collided with the receptacle.
        """
        objects = self._environment.view.objects
        self._collided.update(
            name for name, nearby in objects.items() if f"'{nearby.name}'" in error
        )
        if f"'{self._receptacle_object.name}'" not in error:
            return False
        for number, hinge in enumerate(self._hinges):
            obstacles = obstacles_of(self._receptacle(hinge))
            if len(obstacles.names) and clearances(parts, obstacles).min() > _UNEXPLAINED:
                self._n_refuted[number] += 1
        return True

    def _receptacle(self, hinge: int) -> _Boxes:
        if self._receptacle_object.pickupable or self.places is None:
            return []
        if self.entry is None:
            boxes = columns(self._receptacle_object, self.places)
        else:
            boxes = cavity(self._receptacle_object, self.places, self.entry, hinge)
        return [(self._receptacle_object.object_id, box) for box in boxes]

    def _boxes_around(self, belief: Belief) -> _Boxes:
        """Return the boxes of the floor, and of everything nearby that cannot be picked up."""
        view = self._environment.view
        wrist: Point = tuple(self._linkage.now.world()[0].tolist())
        around = [("Floor", self._floor)]
        for name, nearby in view.objects.items():
            if (
                nearby.pickupable
                or nearby.object_type == "Floor"
                or name == self._receptacle_object.object_id
            ):
                continue
            box = corners_of(nearby)
            if _distance_to_box(wrist, box) > _REACH:
                continue
            is_whole = belief == Belief.WHOLE and not self._is_in(box)
            boxes = [box] if is_whole else self._boxes_of(nearby)
            around += [(name, part) for part in boxes if not self._has_places_in(part)]
        return around

    def _has_places_in(self, box: Corners) -> bool:
        """Return whether a box has places of the receptacle: it is partly empty, as a table is."""
        if self.places is None:
            return False
        points = self.places.points
        is_above = points > np.array(box.low) + _SUNK
        is_below = points < np.array(box.high) - _SUNK
        return bool((is_above & is_below).all(axis=1).any())

    def _is_in(self, box: Corners) -> bool:
        """Return whether the arm is in a box, which is then partly empty."""
        parts = self._linkage.parts(self._linkage.now)
        return bool(clearances(parts, obstacles_of([("", box)])).min() < 0)

    def _boxes_of(self, furniture: ThorObject) -> list[Corners]:
        """Return furniture's boxes without the room in an open cupboard, or below a counter."""
        is_cupboard = is_entered(furniture) and furniture.openable
        hollow = furniture.is_open if is_cupboard else not furniture.openable
        places = (
            places_of(self._environment, furniture) if furniture.receptacle and hollow else None
        )
        if places is None:
            return [corners_of(furniture)]
        entry = entry_of(self._environment.view, furniture, places)
        if entry is None:
            return columns(furniture, places)
        return cavity(furniture, places, entry, _hinges(furniture, places, entry)[0])


def _distance_to_box(point: Point, box: Corners) -> float:
    """Return the metres from a point to a box."""
    by_axis = zip(box.low, point, box.high, strict=True)
    return math.hypot(*(max(low - value, value - high, 0.0) for low, value, high in by_axis))


def _hinges(furniture: ThorObject, places: Places | None, entry: Entry | None) -> list[int]:
    """Return the edges of an opening that the door may hang on, the likeliest first; see `cavity`.

    The origin of a cupboard is at its hinge.
    """
    if entry is None or places is None or not furniture.openable:
        return [0]
    across = 2 - entry.axis
    low = float(places.points[:, across].min())
    high = float(places.points[:, across].max())
    aside = (furniture.position.x if across == 0 else furniture.position.z) - (low + high) / 2
    right = entry.sign if entry.axis == 0 else -entry.sign
    if abs(aside) > _ASIDE * (high - low):
        first = 1 if aside > 0 else -1
    else:
        first = -right if furniture.object_type in _LEFT else right
    return [first, -first, 0]
