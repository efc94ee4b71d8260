"""Object ids recorded by another AI2-THOR version, or in a scene restored from poses, to ids of this
simulator.

An id holds its type and the position that the object had when the scene was set up, so the object meant is
the one of that type nearest to that position then. The choice is made once per episode and kept, because
objects move and ids do not.
"""

import math
from collections.abc import Iterable

from infthor_eval.thor.actions import object_type_of
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["Grounding", "id_position"]


def id_position(object_id: str) -> tuple[float, float, float] | None:
    """The position (metres) that an id holds; None where it holds none."""
    parts = object_id.split("|")[1:4]
    try:
        x, y, z = (float(part) for part in parts)
    except ValueError:
        return None
    return x, y, z


class Grounding:
    """The ids of one episode. `distances` tells how far each chosen object lies from where its id says, in
    metres."""

    def __init__(self, view: SimulatorView) -> None:
        """Remember where everything is.

        Args:
            view: the world when the episode begins, after the scene was restored.
        """
        self._homes = {key: _position(item) for key, item in view.objects.items()}
        self._chosen: dict[str, str] = {}
        self.distances: dict[str, float] = {}

    def ground(self, object_id: str, view: SimulatorView) -> str | None:
        """The id that the simulator has for a recorded one.

        Args:
            object_id: as recorded.
            view: the world now.

        Returns:
            None where the scene has no object of that type.
        """
        chosen = self._chosen.get(object_id)
        if chosen in view.objects:
            return chosen
        if object_id in view.objects:
            self._chosen[object_id], self.distances[object_id] = object_id, 0.0
            return object_id
        object_type = object_type_of(object_id)
        taken = set(self._chosen.values())
        fitting = [item for item in view.objects.values() if item.object_type == object_type]
        # Two recorded things of one type are two things here, unless the scene has too few; furniture may be
        # merged.
        free = [item for item in fitting if not item.pickupable or item.object_id not in taken]
        return self._choose(object_id, free or fitting)

    def _choose(self, object_id: str, candidates: Iterable[ThorObject]) -> str | None:
        target = id_position(object_id)
        ranked = sorted((self._gap(item, target), item.object_id) for item in candidates)
        if not ranked:
            return None
        self.distances[object_id], self._chosen[object_id] = ranked[0]
        return ranked[0][1]

    def _gap(self, item: ThorObject, target: tuple[float, float, float] | None) -> float:
        """Distance from where the recorded id says to where the object was, by its place or by its own id."""
        if target is None:
            return 0.0
        places = [self._homes.get(item.object_id, _position(item)), id_position(item.object_id)]
        return min(math.dist(target, place) for place in places if place is not None)


def _position(item: ThorObject) -> tuple[float, float, float]:
    return item.position.x, item.position.y, item.position.z
