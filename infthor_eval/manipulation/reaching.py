"""How an arm that knows where everything is brings its hand there, to pick something up or to put it down."""

import math
from collections.abc import Iterator, Sequence

from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import Point, along, away, middle_of, point_of, xyz
from infthor_eval.manipulation.history import ManipulationKind
from infthor_eval.manipulation.putting import put
from infthor_eval.manipulation.stand import Stand
from infthor_eval.thor.view import SimulatorView

__all__ = ["plan"]

_SHIFTS = (0.0, 0.25, -0.25, 0.5, -0.5)  # metres by which the base is brought above a target, one after the other

Steps = Iterator[Sequence[Call]]


def plan(environment: ArmEnvironment) -> Steps:
    """Steps to the end of the present episode: each after the one before was carried out."""
    return _pick_up(environment) if environment.errand.kind == ManipulationKind.PICKUP else put(environment)


def _pick_up(environment: ArmEnvironment) -> Steps:
    target = environment.moment.object_id
    for call in _approach(environment, target):
        if target in arm_of(environment.view).pickupable:
            yield [{"action": "PickupObject", "objectIdCandidates": [target]}]
        yield [call]


def _approach(environment: ArmEnvironment, target: str) -> Iterator[Call]:
    """Bring the arm to the target's height, then others; at each turn the hand to it, and move the hand up to it."""
    for shift in _SHIFTS:
        goal = middle_of(environment.view.objects[target])
        yield _lift(environment.view, goal[1] + shift)
        yield _aim(environment.view, goal)
        yield _move(_short_of(environment.view, goal))
        yield _aim(environment.view, goal)
        yield _move(_short_of(environment.view, goal))
        yield {"action": "Pass"}


def _aim(view: SimulatorView, goal: Point) -> Call:
    """Turn the hand so that it looks at a point."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    now, wanted = away(wrist, point_of(arm.sphere_center)), away(wrist, goal)
    yaw = math.degrees(math.atan2(wanted[0], wanted[2]) - math.atan2(now[0], now[2]))
    pitch = math.degrees(_elevation(now) - _elevation(wanted))
    return {"action": "RotateWristRelative", "pitch": pitch, "yaw": yaw, "roll": 0.0, "returnToStart": False}


def _elevation(direction: Point) -> float:
    return math.atan2(direction[1], math.hypot(direction[0], direction[2]))


def _short_of(view: SimulatorView, goal: Point) -> Point:
    """Where the wrist is to be for the sphere to have its centre at a point, coming from where it is."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    length = math.dist(wrist, point_of(arm.sphere_center))
    distance = math.dist(wrist, goal)
    return along(wrist, goal, max(0.0, distance - length) / distance) if distance else wrist


def _lift(view: SimulatorView, height: float) -> Call:
    """Bring the arm's base to a height of the world, as far as it goes."""
    return {"action": "MoveArmBase", "y": Stand.of(view.agent).share(height), "returnToStart": False}


def _move(wrist: Point) -> Call:
    return {"action": "MoveArm", "position": xyz(wrist), "coordinateSpace": "world", "returnToStart": False}
