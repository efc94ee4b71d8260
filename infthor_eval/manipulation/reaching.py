"""How an arm that knows where everything is brings its hand there: by inverse kinematics, in straight lines."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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
_DRAWN_IN = 0.35  # metres by which the arm is drawn in before it enters something
_GAP = 0.04  # metres between an opening and what is held before it
_BREADTH = 0.05  # metres
_PLACES = 3  # of a receptacle that are tried with each clearance
# Metres between a place and what is let go above it, one after the other.
_FROM_ABOVE = (0.15, 0.4, 0.05)
_IN_FRONT = (0.02, 0.06, 0.12)
_ENTERED = {"Fridge", "Microwave", "Cabinet", "Safe", "CoffeeMachine", "Shelf", "ShelvingUnit"}  # from the front

Steps = Iterator[Sequence[Call]]
Entry = tuple[Point, float]  # the direction out of an opening, and where that is along it


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
    """Bring what is held over each of some places, or into it, and let go as soon as it is over any."""
    receptacle = environment.view.objects[str(environment.moment.receptacle_id)]
    every = _all_places(environment, receptacle)
    entry = _entry(environment.view, receptacle, every)
    held, others = environment.view.objects[environment.moment.object_id], _others(environment, receptacle)
    free = [p for p in every if not _sticks_out(p, held, receptacle) and not _is_taken(p, held, others)]
    safe = [p for p in free if not _is_covered(p, environment.view, receptacle)]
    for call, place in _ways(environment, receptacle, every, entry):
        yield [call]
        if _is_over(environment, receptacle, [*safe, place]):
            yield [{"action": "ReleaseObject"}]


def _ways(
    environment: ArmEnvironment, receptacle: ThorObject, every: Sequence[Point], entry: Entry | None
) -> Iterator[tuple[Call, Point]]:
    """Ways over one place after the other, from above or through an opening, each with the way back; and the place."""
    rest = point_of(arm_of(environment.view).wrist)
    if entry is not None:
        rest = _drawn_in(environment.view)  # what is held may be before a side of what it is to be put into
        yield _move(rest), rest
    for clearance in _FROM_ABOVE if entry is None else _IN_FRONT:
        for place in _best_places(environment, receptacle, every, clearance):
            goal = _Goal(environment, receptacle, clearance)
            if goal.is_beyond_reach(place):
                yield _turn_towards(environment.view, place), place
            way = _from_above(goal, place) if entry is None else _through(goal, place, entry)
            yield from ((call, place) for call in way)
            yield _move((rest[0], point_of(arm_of(environment.view).wrist)[1], rest[2])), place


@dataclass(frozen=True)
class _Goal:
    """Moves what is held over points."""

    environment: ArmEnvironment
    receptacle: ThorObject
    clearance: float

    def wrist(self, point: Point) -> Point:
        return _wrist_above(self.environment, point, self.clearance, self.receptacle)

    def is_beyond_reach(self, point: Point) -> bool:
        """Whether the wrist does not come over a point with the hand as it is turned."""
        shoulder, wrist = point_of(arm_of(self.environment.view).joints[1].position), self.wrist(point)
        return math.hypot(wrist[0] - shoulder[0], wrist[2] - shoulder[2]) > _REACH

    def over(self, point: Point) -> Call:
        return _move(self.wrist(point))

    def rise(self, point: Point) -> Call:
        """Straight up or down to the height over a point, where the base alone does not bring the wrist there."""
        x, _, z = point_of(arm_of(self.environment.view).wrist)
        return _move((x, self.wrist(point)[1], z))

    def lift(self, point: Point) -> Call:
        """Bring the wrist to the height that it has over a point, as far as the base alone brings it there."""
        arm = arm_of(self.environment.view)
        change = self.wrist(point)[1] - point_of(arm.wrist)[1]
        return _lift(self.environment.view, arm.base_height + change)


def _from_above(goal: _Goal, place: Point) -> Iterator[Call]:
    yield goal.lift(place)
    yield goal.over(place)


def _through(goal: _Goal, place: Point, entry: Entry) -> Iterator[Call]:
    """Straight to before the opening and in; where a door is in the way, over it."""
    before = _before(goal.environment, place, entry)
    yield goal.lift(place)
    yield goal.over(before)
    if not _is_at(goal, before):
        top = middle_of(goal.receptacle)[1] + size_of(goal.receptacle)[1] / 2
        above = before[0], top + _GAP, before[2]
        yield _move(_drawn_in(goal.environment.view))
        yield goal.lift(above)
        yield goal.rise(above)
        yield goal.over(above)
        yield goal.lift(before)
        yield goal.over(before)
    yield goal.over(place)
    yield goal.over(before)


def _is_at(goal: _Goal, point: Point) -> bool:
    return math.dist(goal.wrist(point), point_of(arm_of(goal.environment.view).wrist)) < _EXACT


def _turn_towards(view: View, place: Point) -> Call:
    """Turn the hand about the vertical, so that arm and hand are in line with the way from the shoulder to a place."""
    arm = arm_of(view)
    now, wanted = away(point_of(arm.wrist), point_of(arm.sphere_center)), away(point_of(arm.joints[1].position), place)
    yaw = math.degrees(math.atan2(wanted[0], wanted[2]) - math.atan2(now[0], now[2]))
    return {"action": "RotateWristRelative", "pitch": 0.0, "yaw": yaw, "roll": 0.0, "returnToStart": False}


def _before(environment: ArmEnvironment, place: Point, entry: Entry) -> Point:
    """A place moved out of the opening, so far that what is held is before it."""
    out, opening = entry
    width = size_of(environment.view.objects[environment.moment.object_id])
    way = opening - (place[0] * out[0] + place[2] * out[2]) + max(width[0], width[2]) / 2 + _GAP
    return place[0] + way * out[0], place[1], place[2] + way * out[2]


def _entry(view: View, receptacle: ThorObject, places: Sequence[Point]) -> Entry | None:
    """The direction out of what is entered from the front, and where its opening is along that.

    An open door widens its box on that side; what has no door is open towards the agent.
    """
    if receptacle.object_type not in _ENTERED or not places:
        return None
    room = [(min(axis) + max(axis)) / 2 for axis in zip(*places, strict=True)]
    towards = middle_of(receptacle) if receptacle.openable else point_of(view.agent.position)
    x, z = towards[0] - room[0], towards[2] - room[2]
    out = (math.copysign(1.0, x), 0.0, 0.0) if abs(x) > abs(z) else (0.0, 0.0, math.copysign(1.0, z))
    return out, max(place[0] * out[0] + place[2] * out[2] for place in places) + _BREADTH


def _wrist_above(environment: ArmEnvironment, place: Point, clearance: float, receptacle: ThorObject) -> Point:
    """Where the wrist is to be for what it holds to be so far above a place; above basins and bins above their rim."""
    held = environment.view.objects[environment.moment.object_id]
    lever = away(middle_of(held), point_of(arm_of(environment.view).wrist))
    rim = middle_of(receptacle)[1] + size_of(receptacle)[1] / 2
    ground = place[1] if receptacle.object_type in _ENTERED else max(place[1], rim)
    return place[0] + lever[0], ground + clearance + size_of(held)[1] / 2 + lever[1], place[2] + lever[2]


def _drawn_in(view: View) -> Point:
    """The wrist drawn in towards the agent."""
    turn, wrist = math.radians(view.agent.rotation), point_of(arm_of(view).wrist)
    return wrist[0] - _DRAWN_IN * math.sin(turn), wrist[1], wrist[2] - _DRAWN_IN * math.cos(turn)


def _all_places(environment: ArmEnvironment, receptacle: ThorObject) -> list[Point]:
    found = environment.query("GetSpawnCoordinatesAboveReceptacle", objectId=receptacle.object_id, anywhere=True)
    return [(place["x"], place["y"], place["z"]) for place in found or []]


def _best_places(
    environment: ArmEnvironment, receptacle: ThorObject, places: Sequence[Point], clearance: float
) -> list[Point]:
    """Places on a receptacle: those that the arm reaches, that are free, and where the thing fits, by distance."""
    view = environment.view
    held, shoulder = view.objects[environment.moment.object_id], point_of(arm_of(view).joints[1].position)
    others = _others(environment, receptacle)
    lever = math.dist(middle_of(held), point_of(arm_of(view).wrist))
    aside = _aside(_entry(view, receptacle, places), places)

    def order(place: Point) -> tuple[bool, bool, bool, bool, int, float]:
        goal = _wrist_above(environment, place, clearance, receptacle)
        level = math.hypot(place[0] - shoulder[0], place[2] - shoulder[2])
        too_far = level > _REACH + lever or not _LOWEST - 0.4 < goal[1] - _floor(view) < _LOWEST + _RANGE + 0.4
        taken, out = _is_taken(place, held, others), _sticks_out(place, held, receptacle)
        return too_far, _is_covered(place, view, receptacle), taken, out, aside[place], level

    return sorted(places, key=order)[:_PLACES]


def _others(environment: ArmEnvironment, receptacle: ThorObject) -> list[ThorObject]:
    """What stands in or on a receptacle, but for what is held."""
    held, key = environment.moment.object_id, receptacle.object_id
    return [
        item for name, item in environment.view.objects.items()
        if item.pickupable and name != held and key in (item.parent_receptacles or ())
    ]  # fmt: skip


def _aside(entry: Entry | None, places: Sequence[Point]) -> dict[Point, int]:
    """How far places are from the middle of an opening, in steps: its sides are in the way."""
    if entry is None:
        return dict.fromkeys(places, 0)
    across = {place: place[2] if entry[0][0] else place[0] for place in places}
    middle = (min(across.values()) + max(across.values())) / 2
    return {place: round(abs(value - middle) / _BREADTH) for place, value in across.items()}


def _is_taken(place: Point, held: ThorObject, others: Sequence[ThorObject]) -> bool:
    """Whether something stands where the thing in the hand would."""
    width = size_of(held)
    for other in others:
        apart, reach = away(middle_of(other), place), size_of(other)
        if all(abs(apart[axis]) < (reach[axis] + width[axis]) / 2 for axis in (0, 2)):
            return True
    return False


def _is_covered(place: Point, view: View, receptacle: ThorObject) -> bool:
    """Whether other furniture reaches over a place, as a counter does over a drawer."""
    for other in view.objects.values():
        if other.pickupable or other.object_id == receptacle.object_id:
            continue
        apart, reach = away(middle_of(other), place), size_of(other)
        if abs(apart[0]) < reach[0] / 2 and abs(apart[2]) < reach[2] / 2 and apart[1] < 0:
            return True
    return False


def _sticks_out(place: Point, held: ThorObject, receptacle: ThorObject) -> bool:
    """Whether the thing in the hand would reach over the edge of the receptacle's box."""
    apart, room, width = away(middle_of(receptacle), place), size_of(receptacle), size_of(held)
    return any(abs(apart[axis]) + width[axis] / 2 > room[axis] / 2 for axis in (0, 2))


def _is_over(environment: ArmEnvironment, receptacle: ThorObject, places: Sequence[Point]) -> bool:
    """Whether what is held has come to be over a place; in what is entered from the front, under its top."""
    held = environment.view.objects[environment.moment.object_id]
    middle, size = middle_of(held), size_of(held)
    top = middle_of(receptacle)[1] + size_of(receptacle)[1] / 2
    if receptacle.object_type in _ENTERED and middle[1] > top:
        return False
    bottom = middle[1] - size[1] / 2
    return any(
        math.hypot(place[0] - middle[0], place[2] - middle[2]) <= _EXACT and bottom > place[1] for place in places
    )


# -- both


def _lift(view: View, height: float) -> Call:
    """Bring the arm's base to a height of the world, as far as it goes."""
    share = min(1.0, max(0.0, (height - _floor(view) - _LOWEST) / _RANGE))
    return {"action": "MoveArmBase", "y": share, "returnToStart": False}


def _floor(view: View) -> float:
    return view.agent.position.y - _FLOOR


def _move(wrist: Point) -> Call:
    return {"action": "MoveArm", "position": xyz(wrist), "coordinateSpace": "world", "returnToStart": False}
