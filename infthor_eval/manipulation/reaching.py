"""How an arm that knows where everything is brings its hand there: by inverse kinematics, in straight lines."""

import math
from collections.abc import Iterator, Sequence

from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import Point, along, away, middle_of, point_of, size_of, xyz
from infthor_eval.manipulation.history import ErrandKind
from infthor_eval.thor.view import ThorObject, View

__all__ = ["plan"]

_LOWEST, _RANGE = 0.451, 1.35  # metres: heights of the arm's base above the floor
_FLOOR = 0.9  # metres from the agent's position down to the floor
_SHIFTS = (0.0, 0.25, -0.25, 0.5, -0.5)  # metres by which the base is brought above a target, one after the other
_REACH = 0.6  # metres from the shoulder, a little less than the arm's own
_EXACT = 0.04  # metres from above a place
_PLACES = 4  # of a receptacle that are tried with each clearance
# Metres between a place and what is let go above it, one after the other.
_FROM_ABOVE = (0.15, 0.4, 0.05)
_IN_FRONT = (0.02, 0.06, 0.12)
_ENTERED = {"Fridge", "Microwave", "Cabinet", "Safe", "CoffeeMachine", "Shelf", "ShelvingUnit"}  # from the front

Steps = Iterator[Sequence[Call]]


def plan(environment: ArmEnvironment) -> Steps:
    """Steps to the end of the present episode: each after the one before was carried out."""
    return _pick_up(environment) if environment.errand.kind == ErrandKind.PICKUP else _put(environment)


# -- picking up


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


def _aim(view: View, goal: Point) -> Call:
    """Turn the hand so that it looks at a point."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    now, wanted = away(wrist, point_of(arm.sphere_center)), away(wrist, goal)
    yaw = math.degrees(math.atan2(wanted[0], wanted[2]) - math.atan2(now[0], now[2]))
    pitch = math.degrees(_elevation(now) - _elevation(wanted))
    return {"action": "RotateWristRelative", "pitch": pitch, "yaw": yaw, "roll": 0.0, "returnToStart": False}


def _elevation(direction: Point) -> float:
    return math.atan2(direction[1], math.hypot(direction[0], direction[2]))


def _short_of(view: View, goal: Point) -> Point:
    """Where the wrist is to be for the sphere to have its centre at a point, coming from where it is."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    length = math.dist(wrist, point_of(arm.sphere_center))
    distance = math.dist(wrist, goal)
    return along(wrist, goal, max(0.0, distance - length) / distance) if distance else wrist


# -- putting


def _put(environment: ArmEnvironment) -> Steps:
    """Bring what is held over each of some places, or into it, and let go where that succeeds."""
    receptacle = environment.view.objects[str(environment.moment.receptacle_id)]
    rest = point_of(arm_of(environment.view).wrist)
    for clearance in _IN_FRONT if receptacle.object_type in _ENTERED else _FROM_ABOVE:
        for place in _places(environment, receptacle, clearance):
            goal = _wrist_above(environment, place, clearance)
            yield [_lift(environment.view, goal[1])]
            yield [_move(_abreast(environment.view, rest, goal))]
            yield [_move(_wrist_above(environment, place, clearance))]
            if _is_above(environment, place):
                yield [{"action": "ReleaseObject"}]
            yield [_move(_back(environment.view, rest))]


def _wrist_above(environment: ArmEnvironment, place: Point, clearance: float) -> Point:
    """Where the wrist is to be for what it holds to be so far above a place."""
    held = environment.view.objects[environment.moment.object_id]
    lever = away(middle_of(held), point_of(arm_of(environment.view).wrist))
    height = place[1] + clearance + size_of(held)[1] / 2
    return place[0] + lever[0], height + lever[1], place[2] + lever[2]


def _abreast(view: View, rest: Point, goal: Point) -> Point:
    """As far ahead as the arm is at rest, and as far aside as a goal: doors stand open at the sides."""
    turn = math.radians(view.agent.rotation)
    ahead = math.sin(turn), math.cos(turn)
    way = away(rest, goal)
    depth = way[0] * ahead[0] + way[2] * ahead[1]
    return goal[0] - depth * ahead[0], point_of(arm_of(view).wrist)[1], goal[2] - depth * ahead[1]


def _back(view: View, rest: Point) -> Point:
    """Straight back to where the wrist is at rest, at the present height."""
    wrist = point_of(arm_of(view).wrist)
    retreat = _abreast(view, rest, wrist)
    return retreat[0], wrist[1], retreat[2]


def _places(environment: ArmEnvironment, receptacle: ThorObject, clearance: float) -> list[Point]:
    """Places on a receptacle: those that the arm reaches, that are free, and where the thing fits, by distance."""
    key = receptacle.object_id
    found = environment.query("GetSpawnCoordinatesAboveReceptacle", objectId=key, anywhere=True) or []
    view = environment.view
    held, shoulder = view.objects[environment.moment.object_id], point_of(arm_of(view).joints[1].position)
    others = [
        item for name, item in view.objects.items()
        if item.pickupable and name != held.object_id and key in (item.parent_receptacles or ())
    ]  # fmt: skip

    def order(place: Point) -> tuple[bool, bool, bool, float]:
        goal = _wrist_above(environment, place, clearance)
        level = math.hypot(goal[0] - shoulder[0], goal[2] - shoulder[2])
        too_far = level > _REACH or not _LOWEST - 0.4 < goal[1] - _floor(view) < _LOWEST + _RANGE + 0.4
        return too_far, _is_taken(place, held, others), _sticks_out(place, held, receptacle), level

    return sorted(((place["x"], place["y"], place["z"]) for place in found), key=order)[:_PLACES]


def _is_taken(place: Point, held: ThorObject, others: Sequence[ThorObject]) -> bool:
    """Whether something stands where the thing in the hand would."""
    width = size_of(held)
    for other in others:
        apart, reach = away(middle_of(other), place), size_of(other)
        if all(abs(apart[axis]) < (reach[axis] + width[axis]) / 2 for axis in (0, 2)):
            return True
    return False


def _sticks_out(place: Point, held: ThorObject, receptacle: ThorObject) -> bool:
    """Whether the thing in the hand would reach over the edge of the receptacle's box."""
    apart, room, width = away(middle_of(receptacle), place), size_of(receptacle), size_of(held)
    return any(abs(apart[axis]) + width[axis] / 2 > room[axis] / 2 for axis in (0, 2))


def _is_above(environment: ArmEnvironment, place: Point) -> bool:
    """Whether what is held has come to be above a place."""
    held = environment.view.objects[environment.moment.object_id]
    apart = away(place, middle_of(held))
    return all(abs(apart[axis]) <= _EXACT for axis in (0, 2)) and apart[1] > 0


# -- both


def _lift(view: View, height: float) -> Call:
    """Bring the arm's base to a height of the world, as far as it goes."""
    share = min(1.0, max(0.0, (height - _floor(view) - _LOWEST) / _RANGE))
    return {"action": "MoveArmBase", "y": share, "returnToStart": False}


def _floor(view: View) -> float:
    return view.agent.position.y - _FLOOR


def _move(wrist: Point) -> Call:
    return {"action": "MoveArm", "position": xyz(wrist), "coordinateSpace": "world", "returnToStart": False}
