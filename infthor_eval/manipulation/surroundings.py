"""What an agent that is to put something down knows of what stands around it, and how sure it is of that."""

import math
from enum import IntEnum

import numpy as np

from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.geometry import Corners, Point, corners_of
from infthor_eval.manipulation.linkage import Linkage, Parts
from infthor_eval.manipulation.places import Entry, Places, entry_of, is_entered, others_on, places_of
from infthor_eval.manipulation.solids import Solids, cavity, columns, gaps, solids_of
from infthor_eval.thor.view import ThorObject

__all__ = ["Belief", "Surroundings"]

_REACHED = 1.5  # metres from the wrist within which things are looked at
_GROUND = 3.0  # metres to each side that the floor is told of
_SUNK = 0.02  # metres that places may be in a box which they are only beside
_UNSEEN = 0.03  # metres from all that was known: what was met there is something else
_ASIDE = 0.25  # of an opening's width: an origin so far from its middle is at the hinge
_LEFT = {"Microwave"}  # doors that hang on the left; others do on the right, where their origin does not tell

_Boxes = list[tuple[str, Corners]]


class Belief(IntEnum):
    """How much of what is known is believed: boxes have room within that the metadata do not tell of."""

    NOTHING = 0
    RECEPTACLE = 1  # what that is made of which something is to be put into or onto
    MET = 2  # and the whole boxes of what was met
    FILLED = 3  # of all furniture what is below its places
    WHOLE = 4  # of all furniture the whole boxes, but for those that the arm is in


class Surroundings:
    """Solids around an agent.

    Attributes:
        places: of the receptacle; None where it has none.
        entry: its opening, if it is entered from the front.
    """

    def __init__(self, environment: ArmEnvironment, linkage: Linkage, floor: float) -> None:
        """Look around.

        Args:
            environment: an episode that is begun.
            linkage: the arm, as it is now.
            floor: its height, metres.
        """
        self._environment, self._linkage = environment, linkage
        self._item = environment.view.objects[str(environment.moment.receptacle_id)]
        self.places = places_of(environment, self._item)
        self.entry = None if self.places is None else entry_of(environment.view, self._item, self.places)
        self._hinges = _hinges(self._item, self.places, self.entry)
        self._wrong = [0] * len(self._hinges)
        x, _, z = linkage.shoulder.tolist()
        self._floor = Corners((x - _GROUND, floor - 1.0, z - _GROUND), (x + _GROUND, floor, z + _GROUND))
        self._met: set[str] = set()
        self._around = {belief: self._boxes_around(belief) for belief in (Belief.FILLED, Belief.WHOLE)}

    def solids(self, belief: Belief) -> Solids:
        """What is in the way, if so much is believed, and the door is where it has proved wrong least often."""
        if belief == Belief.NOTHING:
            return solids_of(())
        hinge = self._hinges[self._wrong.index(min(self._wrong))]
        around = self._around.get(belief, [])
        if belief == Belief.MET:
            around = [(name, box) for name, box in self._around[Belief.WHOLE] if name in self._met]
        return solids_of([*self._receptacle(hinge), *around])

    def others(self) -> list[Corners]:
        """What may stand on the receptacle's places, or cover them: loose things, and what is fixed around it."""
        loose = others_on(self._environment.view, self._item, self._environment.moment.object_id)
        return [*map(corners_of, loose), *(box for _, box in self._around[Belief.FILLED])]

    def met(self, parts: Parts, error: str) -> bool:
        """The arm met something in a pose (1): count that against each side of the door where nothing is known there.

        Args:
            parts: of the arm.
            error: what the simulator said.

        Returns:
            Whether it was the receptacle.
        """
        objects = self._environment.view.objects
        self._met.update(name for name, item in objects.items() if f"'{item.name}'" in error)
        if f"'{self._item.name}'" not in error:
            return False
        for number, hinge in enumerate(self._hinges):
            solids = solids_of(self._receptacle(hinge))
            if len(solids.names) and gaps(parts, solids).min() > _UNSEEN:
                self._wrong[number] += 1
        return True

    def _receptacle(self, hinge: int) -> _Boxes:
        if self._item.pickupable or self.places is None:
            return []
        if self.entry is None:
            boxes = columns(self._item, self.places)
        else:
            boxes = cavity(self._item, self.places, self.entry, hinge)
        return [(self._item.object_id, box) for box in boxes]

    def _boxes_around(self, belief: Belief) -> _Boxes:
        """The floor, and what does not give way."""
        view = self._environment.view
        wrist: Point = tuple(self._linkage.now.world()[0].tolist())
        found = [("Floor", self._floor)]
        for name, item in view.objects.items():
            if item.pickupable or item.object_type == "Floor" or name == self._item.object_id:
                continue
            box = corners_of(item)
            if _apart(wrist, box) > _REACHED:
                continue
            is_whole = belief == Belief.WHOLE and not self._is_in(box)
            boxes = [box] if is_whole else self._boxes_of(item)
            found += [(name, part) for part in boxes if not self._has_places_in(part)]
        return found

    def _has_places_in(self, box: Corners) -> bool:
        """Whether places of the receptacle are in a box, as those of a shelf are in a table's: it is not filled."""
        if self.places is None:
            return False
        points = self.places.points
        return bool(((points > np.array(box.low) + _SUNK) & (points < np.array(box.high) - _SUNK)).all(axis=1).any())

    def _is_in(self, box: Corners) -> bool:
        """Whether the arm is in a box, which is then not filled."""
        return bool(gaps(self._linkage.parts(self._linkage.now), solids_of([("", box)])).min() < 0)

    def _boxes_of(self, item: ThorObject) -> list[Corners]:
        """An open cupboard has room within, a counter may have."""
        hollow = item.is_open if is_entered(item) and item.openable else not item.openable
        places = places_of(self._environment, item) if item.receptacle and hollow else None
        if places is None:
            return [corners_of(item)]
        entry = entry_of(self._environment.view, item, places)
        if entry is None:
            return columns(item, places)
        return cavity(item, places, entry, _hinges(item, places, entry)[0])


def _apart(point: Point, box: Corners) -> float:
    """Metres from a point to a box."""
    return math.hypot(*(max(a - v, v - b, 0.0) for a, v, b in zip(box.low, point, box.high, strict=True)))


def _hinges(item: ThorObject, places: Places | None, entry: Entry | None) -> list[int]:
    """Edges of an opening on which the door may hang, the likeliest first, as coordinates go; 0 where there is none.

    The origin of a cupboard is where its hinge is.
    """
    if entry is None or places is None or not item.openable:
        return [0]
    across = 2 - entry.axis
    low, high = float(places.points[:, across].min()), float(places.points[:, across].max())
    aside = (item.position.x if across == 0 else item.position.z) - (low + high) / 2
    right = entry.sign if entry.axis == 0 else -entry.sign
    if abs(aside) > _ASIDE * (high - low):
        first = 1 if aside > 0 else -1
    else:
        first = -right if item.object_type in _LEFT else right
    return [first, -first, 0]
