"""How an arm that knows where everything is moves its hand to pick an object up or put it down."""

import math
from collections.abc import Iterator, Sequence

from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import Point, interpolate, middle_of, offset, point_of, xyz
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.planner.linkage import ArmStand
from infthor_eval.manipulation.planner.putting import put_steps
from infthor_eval.thor.view import SimulatorView

_SHIFTS = (0.0, 0.25, -0.25, 0.5, -0.5)  # metres of the base above a target, tried in order

Steps = Iterator[Sequence[Call]]


def plan_steps(environment: ArmEnvironment) -> Steps:
    """Yield steps up to the end of the episode, each planned after the one before it ran."""
    is_pickup = environment.episode.kind == ManipulationKind.PICKUP
    return _pick_up(environment) if is_pickup else put_steps(environment)


def _pick_up(environment: ArmEnvironment) -> Steps:
    target = environment.start.object_id
    for call in _approach(environment, target):
        if target in arm_of(environment.view).pickupable:
            yield [{"action": "PickupObject", "objectIdCandidates": [target]}]
        yield [call]


def _approach(environment: ArmEnvironment, target: str) -> Iterator[Call]:
    """Yield movements of the hand to a target, from several heights of the arm's base.

    At each height the hand is aimed and moved twice: what blocked the first movement may let the
    second one pass, as it begins elsewhere.
    """
    for shift in _SHIFTS:
        goal = middle_of(environment.view.objects[target])
        share = ArmStand.of(environment.view.agent).share(goal[1] + shift)
        yield {"action": "MoveArmBase", "y": share, "returnToStart": False}
        for _ in range(2):
            yield _aim(environment.view, goal)
            yield {
                "action": "MoveArm",
                "position": xyz(_wrist_before(environment.view, goal)),
                "coordinateSpace": "world",
                "returnToStart": False,
            }
        yield {"action": "Pass"}


def _aim(view: SimulatorView, goal: Point) -> Call:
    """Turn the hand so that it points to a goal."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    now = offset(wrist, point_of(arm.sphere_center))
    aim = offset(wrist, goal)
    yaw = math.degrees(math.atan2(aim[0], aim[2]) - math.atan2(now[0], now[2]))
    pitch = math.degrees(_elevation(now) - _elevation(aim))
    return {
        "action": "RotateWristRelative",
        "pitch": pitch,
        "yaw": yaw,
        "roll": 0.0,
        "returnToStart": False,
    }


def _elevation(direction: Point) -> float:
    return math.atan2(direction[1], math.hypot(direction[0], direction[2]))


def _wrist_before(view: SimulatorView, goal: Point) -> Point:
    """Return the wrist's position with the sphere's centre at a goal, on the straight way there."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    length = math.dist(wrist, point_of(arm.sphere_center))
    distance = math.dist(wrist, goal)
    return interpolate(wrist, goal, max(0.0, distance - length) / distance) if distance else wrist
