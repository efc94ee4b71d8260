"""What replays show of an arm: the frame, the arm and nearby objects in the agent's coordinates."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.manipulation.environment import arm_of
from infthor_eval.manipulation.geometry import Point, middle_of, point_of, size_of
from infthor_eval.manipulation.recorded.replay_frames import (
    ArmObservation,
    NearbyObject,
    Place,
    Reach,
)
from infthor_eval.thor.view import SimulatorView, ThorObject

_MARGIN = 0.1  # metres around what a picture must contain
_NEAR = 2.5  # metres from the agent within which objects are drawn
_NOT_DRAWN = {"Floor", "Wall", "Ceiling"}  # the room itself, as large as the picture


class ArmObserver:
    """Observes one episode; all its pictures have the same bounds."""

    def __init__(self, begun: SimulatorView, hands: Iterable[Point], named: Sequence[str]) -> None:
        """Set the bounds by the world at the start, and the sphere's centres in it.

        Args:
            named: ids of the objects that the instruction names.
        """
        self._agent = begun.agent
        self._named = frozenset(named)
        self._path = [self._hand(begun)]
        points = [
            *self._path,
            *map(self._to_agent, hands),
            *self._joints(begun),
            (0.0, 0.0, self._path[0][2]),
        ]
        for nearby in self._objects(begun):
            if nearby.is_named:
                points += [(*corner, nearby.low) for corner in nearby.corners]
                points += [(*corner, nearby.high) for corner in nearby.corners]
        radius = arm_of(begun).sphere_radius
        right, ahead, up = self._path[0]
        points += [(right + offset, ahead + offset, up + offset) for offset in (-radius, radius)]
        self._low = _corner(points, min, -_MARGIN)
        self._high = _corner(points, max, _MARGIN)

    def observe(self, view: SimulatorView) -> ArmObservation:
        """Return what is seen in the next view of the episode; DataError if it has no frame."""
        if view.frame is None:
            raise DataError("the simulator sent no frame; use one that renders")
        arm = arm_of(view)
        hand = self._hand(view)
        if hand != self._path[-1]:
            self._path.append(hand)
        reach = Reach(
            joints=tuple(self._joints(view)),
            hand=hand,
            radius=arm.sphere_radius,
            path=tuple(self._path),
            objects=tuple(self._objects(view)),
            low=self._low,
            high=self._high,
        )
        return ArmObservation(view.frame, reach, tuple(map(object_type_of, arm.held)))

    def _hand(self, view: SimulatorView) -> Place:
        return self._to_agent(point_of(arm_of(view).sphere_center))

    def _joints(self, view: SimulatorView) -> Iterator[Place]:
        return (self._to_agent(point_of(joint.position)) for joint in arm_of(view).joints)

    def _objects(self, view: SimulatorView) -> Iterator[NearbyObject]:
        return (self._nearby(each) for each in view.objects.values() if self._is_drawn(each))

    def _is_drawn(self, thor_object: ThorObject) -> bool:
        if thor_object.object_id in self._named:
            return True
        if (
            thor_object.object_type in _NOT_DRAWN
            or thor_object.pickupable
            or thor_object.axis_aligned_bounding_box is None
        ):
            return False
        right, ahead, _ = self._to_agent(middle_of(thor_object))
        return (thor_object.receptacle or thor_object.moveable) and math.hypot(right, ahead) < _NEAR

    def _nearby(self, thor_object: ThorObject) -> NearbyObject:
        x, y, z = middle_of(thor_object)
        width, height, depth = size_of(thor_object)
        signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        corners = (self._to_agent((x + i * width / 2, y, z + j * depth / 2))[:2] for i, j in signs)
        is_named = thor_object.object_id in self._named
        return NearbyObject(
            thor_object.object_type, tuple(corners), y - height / 2, y + height / 2, is_named
        )

    def _to_agent(self, point: Point) -> Place:
        """Return a point in the agent's coordinates; its rotation goes from +z towards +x."""
        x = point[0] - self._agent.position.x
        z = point[2] - self._agent.position.z
        turn = math.radians(self._agent.rotation)
        right = x * math.cos(turn) - z * math.sin(turn)
        return right, x * math.sin(turn) + z * math.cos(turn), point[1]


def _corner(
    points: Sequence[Place], choose: Callable[[Iterable[float]], float], margin: float
) -> Place:
    right, ahead, up = zip(*points, strict=True)
    return choose(right) + margin, choose(ahead) + margin, choose(up) + margin
