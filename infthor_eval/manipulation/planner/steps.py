"""How an arm that knows where everything is moves its hand to pick an object up or put it down.

To put down takes paths to a place, and what collisions show of the surroundings. Poses to release
the object in, and to pass on the way, are drawn at random.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import (
    Corners,
    Point,
    interpolate,
    middle_of,
    offset,
    point_of,
    xyz,
)
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.planner.linkage import (
    ArmStand,
    Array,
    Linkage,
    Poses,
    angles_of,
    heading,
)
from infthor_eval.manipulation.planner.places import Entry, Places, firmness, occupancy, support
from infthor_eval.manipulation.planner.roadmap import (
    ArmMove,
    Contact,
    MoveKind,
    Roadmap,
    Terrain,
    first_pose_of,
)
from infthor_eval.manipulation.planner.surroundings import Belief, Surroundings
from infthor_eval.thor.view import SimulatorView

_MAX_PATHS = 40  # after which it gives up
# metres, and entries of rotations, within which a pose is reached
_EXACT = 0.015
_LEVEL = 0.03
# Beliefs about obstacles, tried one after the other until there is a path, and the number of poses
# drawn for each. The metadata's boxes are larger than the things, so with all of them there is
# often no path.
_ATTEMPTS = (
    (Belief.WHOLE, 200), (Belief.FILLED, 200), (Belief.COLLIDED, 200), (Belief.RECEPTACLE, 500),
    (Belief.NOTHING, 200)
)  # fmt: skip

# Release poses that are drawn, rated (of those within reach), tested for collisions (of the best),
# and kept. Each step costs more a pose than the one before, so it sees fewer of them.
_DRAWN = 8000
_RATED = 1000
_TESTED = 400
_KEPT = 24
# Metres between a place, or a rim, and the object released above it.
_ABOVE = (0.02, 0.02, 0.06, 0.12, 0.25, 0.4)
# In units of the places' spacing: a receptacle narrower than the first has few places, and one may
# go beyond its outermost ones by the second.
_FEW = 1.5
_BEYOND = 0.4
_RIM = 0.05  # metres that a rim is above the places within it
_INTO = 0.3  # share of poses that are below a rim, as on the seat of a sofa
_YAWS = np.radians(np.arange(-150.0, 151.0, 30.0))  # directions of the hand, from straight ahead
_PITCHES = np.radians((0.0, 0.0, 30.0, 60.0, 90.0, -30.0))  # angles of the hand, downwards
_BASES = (0.0, 0.2, -0.2, 0.4, -0.4)  # metres of the base above the wrist
# Costs of release poses, in metres of path: of an object over an edge, or on other objects; of a
# place at an edge; of releasing below a rim; of a radian that the hand points down, or aside; of a
# metre to fall.
_LOOSE = 1.0
_OCCUPIED = 3.0
_EDGE = 0.6
_BELOW_RIM = 0.3
_PITCHED = 0.2
_TURNED = 0.05
_DROP = 0.5
# Cost of each collision with the receptacle within so many metres of the place
_COLLIDED = 0.2
_NEAR = 0.06
_OUT = (0.12, 0.24, 0.36, 0.5, 0.65)  # metres before a place
_CLEAR = 0.02  # metres by which the object is raised on the way there
_UP = (0.08, 0.2, 0.4)  # metres above a place
_FOLDED_REACHES = (-0.2, 0.05, 0.2)  # metres of the wrist ahead, with the arm drawn in
_FOLDED_YAWS = np.radians((0.0, 60.0, -60.0, 120.0, -120.0))
_N_HEIGHTS = 4
_WASTE = 6  # poses that are drawn for each that is kept, as most collide
_LEVEL_SHARE = 0.4  # share of them in which the hand is level
_AROUND = 0.15  # metres around the present pose
_SHIFTS = (0.0, 0.25, -0.25, 0.5, -0.5)  # metres of the base above a target, tried in order

_Steps = Iterator[Sequence[Call]]


def plan_steps(environment: ArmEnvironment) -> _Steps:
    """Yield steps up to the end of the episode, each planned after the one before it ran."""
    is_pickup = environment.episode.kind == ManipulationKind.PICKUP
    return _pick_up(environment) if is_pickup else _put_down(environment)


def _pick_up(environment: ArmEnvironment) -> _Steps:
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
        yield _move_base(share)
        for _ in range(2):
            yield _aim(environment.view, goal)
            yield _move_wrist(_wrist_before(environment.view, goal))
        yield {"action": "Pass"}


def _aim(view: SimulatorView, goal: Point) -> Call:
    """Turn the hand so that it points to a goal."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    now = offset(wrist, point_of(arm.sphere_center))
    aim = offset(wrist, goal)
    yaw = math.degrees(math.atan2(aim[0], aim[2]) - math.atan2(now[0], now[2]))
    pitch = math.degrees(_elevation(now) - _elevation(aim))
    return _turn_wrist(pitch, yaw, 0.0)


def _move_base(share: float) -> Call:
    return _staying("MoveArmBase", y=share)


def _move_wrist(place: Point) -> Call:
    return _staying("MoveArm", position=xyz(place), coordinateSpace="world")


def _turn_wrist(pitch: float, yaw: float, roll: float) -> Call:
    return _staying("RotateWristRelative", pitch=pitch, yaw=yaw, roll=roll)


def _staying(action: str, **arguments: Any) -> Call:
    """Return the call of a movement after which the arm stays where it is, collided or not."""
    return {"action": action, **arguments, "returnToStart": False}


def _elevation(direction: Point) -> float:
    return math.atan2(direction[1], math.hypot(direction[0], direction[2]))


def _wrist_before(view: SimulatorView, goal: Point) -> Point:
    """Return the wrist's position with the sphere's centre at a goal, on the straight way there."""
    arm = arm_of(view)
    wrist = point_of(arm.wrist)
    length = math.dist(wrist, point_of(arm.sphere_center))
    distance = math.dist(wrist, goal)
    return interpolate(wrist, goal, max(0.0, distance - length) / distance) if distance else wrist


@dataclass(frozen=True)
class PutGoal:
    """Where an object is to be put.

    Attributes:
        places: places at which it can stand.
        entry: opening that it is brought in through; None if the receptacle is open above.
        others: boxes of objects that may stand there, or be over it.
    """

    places: Places
    entry: Entry | None
    others: Sequence[Corners]


def _put_down(environment: ArmEnvironment) -> _Steps:
    """Yield steps that bring the object over a place and release it; anew after collisions."""
    task = _PutTask(environment)
    for _ in range(_MAX_PATHS):
        moves = task.moves()
        if moves is None:
            if not task.forget():
                return
            continue
        for move in moves:
            yield [task.call(move)]
            if not task.has_reached(move):
                break
        else:
            yield [{"action": "ReleaseObject"}]


class _PutTask:
    """One put, with what is known of its surroundings."""

    def __init__(self, environment: ArmEnvironment) -> None:
        self._environment = environment
        self._random = np.random.default_rng(0)  # the same paths in every run
        self._stand = ArmStand.of(environment.view.agent)
        self._first: Linkage | None = None
        self._first = self._linkage = self._measure()
        self._contacts: list[Contact] = []
        self._surroundings = Surroundings(environment, self._linkage, self._stand.floor)

    def moves(self) -> list[ArmMove] | None:
        """Return a path from the present pose to a release pose; None if none is found."""
        goal = self._goal()
        if goal is None:
            return None
        self._linkage = self._measure()
        for belief, count in _ATTEMPTS:
            obstacles = self._surroundings.obstacles(belief)
            terrain = Terrain(
                self._linkage, obstacles, self._contacts, escapes=belief <= Belief.COLLIDED
            )
            ends = release_poses(goal, terrain, self._stand, self._random)
            if not len(ends.poses):
                continue
            others = passing_poses(goal, terrain, self._stand, ends.poses, count, self._random)
            path = Roadmap(terrain, others, ends.poses, ends.costs).find_path()
            if path is not None:
                return path
        return None

    def call(self, move: ArmMove) -> Call:
        """Return a movement as a call of AI2-THOR's."""
        if move.kind == MoveKind.LIFT:
            return _move_base(self._stand.share(float(move.pose.bases[0])))
        if move.kind == MoveKind.REACH:
            x, y, z = move.pose.world()[0].tolist()
            return _move_wrist((x, y, z))
        return _turn_wrist(*angles_of(self._linkage.now.turns[0].T @ move.pose.turns[0]))

    def has_reached(self, move: ArmMove) -> bool:
        """Return whether the arm is where a movement was to bring it; a collision is remembered."""
        self._linkage = self._measure()
        now = self._linkage.now
        view = self._environment.view
        if not view.success:
            pose = first_pose_of(now, move)
            parts = self._linkage.parts(pose)
            on_goal = self._surroundings.add_collision(parts, view.error)
            self._contacts.append(Contact(pose.world()[0], parts.center[0, -1], on_goal))
            return False
        exact = np.abs(now.world() - move.pose.world()).max() < _EXACT
        return bool(exact and np.abs(now.turns - move.pose.turns).max() < _LEVEL)

    def forget(self) -> bool:
        """Forget all collisions, as they may leave no path; return whether there was any."""
        had_contacts = bool(self._contacts)
        self._contacts.clear()
        return had_contacts

    def _goal(self) -> PutGoal | None:
        """Return where to put the object; None if the receptacle has no places."""
        around = self._surroundings
        if around.places is None:
            return None
        return PutGoal(around.places, around.entry, around.others())

    def _measure(self) -> Linkage:
        view = self._environment.view
        return Linkage(arm_of(view), view.objects[self._environment.start.object_id], self._first)


@dataclass(frozen=True)
class _ReleasePoses:
    """Poses in which to release an object (n), and their costs (n,) in metres of path."""

    poses: Poses
    costs: Array


def release_poses(
    goal: PutGoal, terrain: Terrain, stand: ArmStand, draw: Generator
) -> _ReleasePoses:
    """Return the best of many poses to release the held object in, in or on a receptacle."""
    poses, costs = _draw_above(goal, terrain.linkage, stand, draw)
    reached = np.flatnonzero(terrain.linkage.can_reach(poses))[:_RATED]
    poses = poses[reached]
    costs = costs[reached]
    held = terrain.linkage.held_box(poses)
    over = support(held, goal.places)
    costs = costs + _LOOSE * (1.0 - over) + _EDGE * (1.0 - firmness(held, goal.places))
    costs = costs + _OCCUPIED * occupancy(held, goal.places, goal.others)
    costs = costs + _COLLIDED * _count_contacts(goal, held.center[:, 0], terrain.contacts)
    good = np.flatnonzero(over > 0)
    best = good[np.argsort(costs[good], kind="stable")][:_TESTED]
    best = best[terrain.free(poses[best])][:_KEPT]
    return _ReleasePoses(poses[best], costs[best])


def _count_contacts(goal: PutGoal, middles: Array, contacts: Sequence[Contact]) -> Array:
    """Count collisions (n,) with the receptacle near the held object; in an opening, on the way."""
    counts = np.zeros(len(middles))
    for contact in contacts:
        if contact.on_goal:
            apart = np.abs(middles - contact.held)
            across = np.hypot(apart[:, 0], apart[:, 2])
            counts += (apart[:, 2 - goal.entry.axis] if goal.entry else across) < _NEAR
    return counts


def _draw_above(
    goal: PutGoal, linkage: Linkage, stand: ArmStand, draw: Generator
) -> tuple[Poses, Array]:
    """Draw poses (n) above places, with their costs (n,) but for how the object would rest."""
    points = _within_reach(goal.places.points, linkage)
    spots = _jitter(points[draw.integers(len(points), size=_DRAWN)], goal.places, draw)
    yaws = draw.choice(_YAWS, size=_DRAWN)
    pitches = draw.choice(_PITCHES, size=_DRAWN)
    is_straight = draw.random(_DRAWN) < 1 / 2
    yaws = np.where(is_straight, yaws, draw.uniform(_YAWS[0], _YAWS[-1], size=_DRAWN))
    turns = heading(stand.heading + yaws, pitches)
    aloft = draw.choice(_ABOVE, size=_DRAWN)
    grounds, more = _grounds(goal, spots, draw)
    costs = _PITCHED * np.abs(pitches) + _TURNED * np.abs(yaws) + _DROP * aloft + more
    held = linkage.held_box(Poses(np.zeros((_DRAWN, 3)), np.zeros(_DRAWN), turns))
    lower = (np.abs(held.axes[:, 0, :, 1]) * held.half[:, 0]).sum(axis=1)
    middles = np.stack([spots[:, 0], grounds + aloft + lower, spots[:, 2]], axis=1)
    wrists = middles - held.center[:, 0]
    bases = np.clip(wrists[:, 1] + draw.choice(_BASES, size=_DRAWN), stand.low, stand.high)
    wrists[:, 1] -= bases
    return Poses(wrists, bases, turns), costs


def _jitter(spots: Array, places: Places, draw: Generator) -> Array:
    """Move places (n, 3) by up to half their spacing, not beyond the outermost ones of many."""
    spacing = places.spacing
    low = places.points.min(axis=0)
    high = places.points.max(axis=0)
    margin = np.where(high - low < _FEW * spacing, _BEYOND * spacing, 0.0)
    moved = spots + spacing * draw.uniform(-1 / 2, 1 / 2, size=spots.shape) * (1.0, 0.0, 1.0)
    clipped: Array = np.clip(moved, low - margin, high + margin)
    return clipped


def _grounds(goal: PutGoal, spots: Array, draw: Generator) -> tuple[Array, Array]:
    """Return heights (n,) to release the object above, over places (n, 3), and costs (n,)."""
    rim = goal.places.top
    if goal.entry is not None or rim < spots[:, 1].max() + _RIM:
        return spots[:, 1], np.zeros(len(spots))
    into = draw.random(len(spots)) < _INTO
    return np.where(into, spots[:, 1], rim), np.where(into, _BELOW_RIM, 0.0)


def _within_reach(points: Array, linkage: Linkage) -> Array:
    """Return the places that the held object could be brought to; all of them if there are none."""
    apart = np.linalg.norm((points - linkage.shoulder)[:, [0, 2]], axis=1)
    near = points[apart <= linkage.reach + np.linalg.norm(linkage.lever)]
    return near if len(near) else points


def passing_poses(
    goal: PutGoal, terrain: Terrain, stand: ArmStand, ends: Poses, count: int, draw: Generator
) -> Poses:
    """Return free poses to pass: before and above releases, folded, near the present, any."""
    linkage = terrain.linkage
    known = Poses.join([*_approaches(ends, goal.entry, stand), _folded_poses(linkage, stand)])
    anywhere = _random_poses(linkage, stand, _WASTE * count, draw)
    nearby = _nearby_poses(linkage, stand, count, draw)
    return Poses.join([
        known[terrain.free(known)],
        anywhere[terrain.free(anywhere)][:count],
        nearby[terrain.free(nearby)][:count],
    ])  # fmt: skip


def _approaches(ends: Poses, entry: Entry | None, stand: ArmStand) -> Iterator[Poses]:
    for up in _UP:
        yield Poses(ends.wrists, np.clip(ends.bases + up, stand.low, stand.high), ends.turns)
        yield Poses(ends.wrists + np.array([0.0, up, 0.0]), ends.bases, ends.turns)
    if entry is not None:
        for out in _OUT:
            wrists = ends.wrists + entry.vector_out(out) + np.array([0.0, _CLEAR, 0.0])
            yield Poses(wrists, ends.bases, ends.turns)


def _folded_poses(linkage: Linkage, stand: ArmStand) -> Poses:
    """Return poses with a folded arm, at some heights, with the hand turned to some sides."""
    heights = np.linspace(stand.low, stand.high, _N_HEIGHTS)
    choices = np.array(list(itertools.product(_FOLDED_REACHES, heights, _FOLDED_YAWS)))
    ahead = np.array([math.sin(stand.heading), 0.0, math.cos(stand.heading)])
    return Poses(
        linkage.shoulder + choices[:, :1] * ahead,
        choices[:, 1],
        heading(stand.heading + choices[:, 2], np.zeros(len(choices))),
    )


def _random_poses(linkage: Linkage, stand: ArmStand, count: int, draw: Generator) -> Poses:
    ways = draw.normal(size=(count, 3))
    ways *= (draw.uniform(0.05, linkage.reach, size=count) / np.linalg.norm(ways, axis=1))[:, None]
    yaws = stand.heading + draw.uniform(_YAWS[0], _YAWS[-1], size=count)
    pitches = np.where(
        draw.random(count) < _LEVEL_SHARE, 0.0, draw.uniform(-math.pi / 4, math.pi / 2, size=count)
    )
    return Poses(
        linkage.shoulder + ways,
        draw.uniform(stand.low, stand.high, size=count),
        heading(yaws, pitches),
    )


def _nearby_poses(linkage: Linkage, stand: ArmStand, count: int, draw: Generator) -> Poses:
    """Draw poses near the present one: a path out of a narrow space begins with small movements."""
    now = linkage.now
    wrists = now.wrists + draw.normal(scale=_AROUND, size=(count, 3))
    bases = np.clip(now.bases + draw.normal(scale=2 * _AROUND, size=count), stand.low, stand.high)
    turns = heading(draw.normal(scale=1.0, size=count), np.zeros(count)) @ now.turns
    is_turned = (draw.random(count) < 1 / 2)[:, None, None]
    return Poses(wrists, bases, np.where(is_turned, turns, now.turns))
