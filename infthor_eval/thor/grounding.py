"""Mapping ids of another AI2-THOR version's objects, or a restored scene's, to this simulator's.

An id has the object's type and its position when the scene was loaded. It is mapped to the object
of this type that was nearest to this position when the episode began. The choice is made once per
episode, as objects move and ids do not.
"""

import math
from collections.abc import Iterable

from msgspec.structs import astuple

from infthor_eval.formats.object_ids import modern_type, object_type_of
from infthor_eval.thor.view import SimulatorView, ThorObject


def id_position(object_id: str) -> tuple[float, float, float] | None:
    """Return the position (metres) in an object id, or None if it has none."""
    parts = object_id.split("|")[1:4]
    try:
        x, y, z = map(float, parts)
    except ValueError:
        return None
    return x, y, z


class Grounding:
    """The id mapping of one episode; `distances` are metres from recorded positions, by that id."""

    def __init__(self, view: SimulatorView) -> None:
        """Store all objects' positions at the episode's start, after the scene was restored."""
        self._initial_positions = {key: astuple(obj.position) for key, obj in view.objects.items()}
        self._chosen: dict[str, str] = {}
        self.distances: dict[str, float] = {}

    def ground(self, object_id: str, view: SimulatorView) -> str | None:
        """Return the simulator's id for a recorded one, or None if no object has the type."""
        chosen = self._chosen.get(object_id)
        if chosen in view.objects:
            return chosen
        if object_id in view.objects:
            self._chosen[object_id] = object_id
            self.distances[object_id] = 0.0
            return object_id
        object_type = modern_type(object_type_of(object_id))
        taken = set(self._chosen.values())
        candidates = [obj for obj in view.objects.values() if obj.object_type == object_type]
        # Two recorded objects of a type are mapped to two objects, unless the scene has too few.
        # Furniture is not restricted: versions differ in how many parts a piece has.
        free = [obj for obj in candidates if not obj.pickupable or obj.object_id not in taken]
        return self._choose(object_id, free or candidates)

    def _choose(self, object_id: str, candidates: Iterable[ThorObject]) -> str | None:
        target = id_position(object_id)
        ranked = sorted((self._distance(obj, target), obj.object_id) for obj in candidates)
        if not ranked:
            return None
        self.distances[object_id], self._chosen[object_id] = ranked[0]
        return ranked[0][1]

    def _distance(self, obj: ThorObject, target: tuple[float, float, float] | None) -> float:
        """Return how far a recorded position, else its id's, is from the initial one."""
        if target is None:
            return 0.0
        # The id has the position at which the scene file has the object; restoring the scene may
        # have moved it.
        positions = [
            self._initial_positions.get(obj.object_id, astuple(obj.position)),
            id_position(obj.object_id),
        ]
        return min(math.dist(target, position) for position in positions if position is not None)
