"""An arm and what is near it, out of a view of the world, as the agent has it before itself."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

from infthor_eval.errors import DataError
from infthor_eval.manipulation.environment import arm_of
from infthor_eval.manipulation.geometry import Point, middle_of, point_of, size_of
from infthor_eval.manipulation.moments import ArmSight, Place, Reach, Solid
from infthor_eval.thor.actions import object_type_of
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["Onlooker"]

_MARGIN = 0.1  # metres around what a picture must hold
_NEAR = 2.5  # metres from the agent; what is farther is not drawn
_NOT_DRAWN = {"Floor", "Wall", "Ceiling"}  # the room's own, as large as the picture


class Onlooker:
    """Looks at one episode; all its pictures have the same bounds."""

    def __init__(self, begun: SimulatorView, hands: Iterable[Point], named: Sequence[str]) -> None:
        """Begin.

        Args:
            begun: the world at the start.
            hands: where the middle of the hand's sphere will be after each step, in the world.
            named: ids of what the episode is about.
        """
        self._agent, self._named = begun.agent, frozenset(named)
        self._way = [self._hand(begun)]
        points = [*self._way, *map(self._place, hands), *self._joints(begun), (0.0, 0.0, self._way[0][2])]
        for solid in filter(lambda solid: solid.is_named, self._solids(begun)):
            points += [(*corner, height) for corner in solid.corners for height in (solid.low, solid.high)]
        radius = arm_of(begun).sphere_radius
        points += [_moved(self._way[0], sign * radius) for sign in (-1, 1)]
        self._low, self._high = _corner(points, min, -_MARGIN), _corner(points, max, _MARGIN)

    def sight(self, view: SimulatorView) -> ArmSight:
        """What there is to be seen after a step; at the start, of that.

        Raises:
            DataError: the simulator sent no frame.
        """
        if view.frame is None:
            raise DataError("the simulator sent no frame; use one that renders")
        arm, hand = arm_of(view), self._hand(view)
        if hand != self._way[-1]:
            self._way.append(hand)
        reach = Reach(
            joints=tuple(self._joints(view)),
            hand=hand,
            radius=arm.sphere_radius,
            way=tuple(self._way),
            solids=tuple(self._solids(view)),
            low=self._low,
            high=self._high,
        )
        return ArmSight(view.frame, reach, tuple(map(object_type_of, arm.held)))

    def _hand(self, view: SimulatorView) -> Place:
        return self._place(point_of(arm_of(view).sphere_center))

    def _joints(self, view: SimulatorView) -> Iterator[Place]:
        return (self._place(point_of(joint.position)) for joint in arm_of(view).joints)

    def _solids(self, view: SimulatorView) -> Iterator[Solid]:
        return (self._solid(item) for item in view.objects.values() if self._is_drawn(item))

    def _is_drawn(self, item: ThorObject) -> bool:
        if item.object_id in self._named:
            return True
        if item.object_type in _NOT_DRAWN or item.pickupable or item.axis_aligned_bounding_box is None:
            return False
        right, ahead, _ = self._place(middle_of(item))
        return (item.receptacle or item.moveable) and math.hypot(right, ahead) < _NEAR

    def _solid(self, item: ThorObject) -> Solid:
        (x, y, z), (wide, high, deep) = middle_of(item), size_of(item)
        signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        corners = (self._place((x + i * wide / 2, y, z + j * deep / 2))[:2] for i, j in signs)
        is_named = item.object_id in self._named
        return Solid(item.object_type, tuple(corners), y - high / 2, y + high / 2, is_named)

    def _place(self, point: Point) -> Place:
        """A point of the world before the agent; its rotation goes from +z towards +x."""
        x, z = point[0] - self._agent.position.x, point[2] - self._agent.position.z
        turn = math.radians(self._agent.rotation)
        right = x * math.cos(turn) - z * math.sin(turn)
        return right, x * math.sin(turn) + z * math.cos(turn), point[1]


def _moved(place: Place, by: float) -> Place:
    return place[0] + by, place[1] + by, place[2] + by


def _corner(points: Sequence[Place], choose: Callable[[Iterable[float]], float], margin: float) -> Place:
    right, ahead, up = (choose(values) + margin for values in zip(*points, strict=True))
    return right, ahead, up
