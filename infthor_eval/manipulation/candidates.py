"""Poses that come into question in a put: those in which to let go, and those to pass on the way, drawn by chance."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from infthor_eval.manipulation.geometry import Corners
from infthor_eval.manipulation.linkage import Array, Linkage, Poses, heading
from infthor_eval.manipulation.places import Entry, Places, firmness, support, taken
from infthor_eval.manipulation.roadmap import Contact, Terrain
from infthor_eval.manipulation.stand import Stand

__all__ = ["Ends", "Goal", "ends_of", "passed"]

# Poses in which to let go: drawn, rated of those within reach, looked at of the best, and kept.
_DRAWN, _RATED, _TESTED, _KEPT = 8000, 1000, 400, 24
_ABOVE = (0.02, 0.02, 0.06, 0.12, 0.25, 0.4)  # metres between a place, or a rim, and what is let go above it
_FEW, _BEYOND = 1.5, 0.4  # distances of places: so wide is where there are few, and so far may one go beyond them
_RIM = 0.05  # metres that a rim is above the places within
_INTO = 0.3  # share of poses that are below a rim, as on the seat of a sofa
_YAWS = np.radians(np.arange(-150.0, 151.0, 30.0))  # ways that the hand looks, from straight ahead
_PITCHES = np.radians((0.0, 0.0, 30.0, 60.0, 90.0, -30.0))  # and that it looks down
_BASES = (0.0, 0.2, -0.2, 0.4, -0.4)  # metres of the base above the wrist
# Costs, in metres of way: of what would lie over an edge, or on other things; of a place at an edge; of letting go
# below a rim; of a radian that the hand looks down, or aside; of a metre to fall.
_MET, _NEAR = 0.2, 0.06  # the same of a place where the receptacle was met so near, metres
_LOOSE, _TAKEN, _EDGE, _BELOW_RIM, _PITCHED, _TURNED, _DROP = 1.0, 3.0, 0.6, 0.3, 0.2, 0.05, 0.5
_OUT = (0.12, 0.24, 0.36, 0.5, 0.65)  # metres before a place
_CLEAR = 0.02  # metres by which what is held is raised on the way there
_UP = (0.08, 0.2, 0.4)  # metres above a place
_DRAWN_IN = (-0.2, 0.05, 0.2)  # metres of the wrist ahead of the shoulder
_FOLDED = np.radians((0.0, 60.0, -60.0, 120.0, -120.0))
_N_HEIGHTS = 4
_WASTE = 6  # poses that are drawn for each that is kept
_LEVEL = 0.4  # share of them in which the hand is level
_AROUND = 0.15  # metres around the present pose


@dataclass(frozen=True)
class Goal:
    """Where something is to be put.

    Attributes:
        places: at which it can stand.
        entry: the opening that it is brought in through; None of what is open above.
        others: boxes of what may stand there, or be over it.
    """

    places: Places
    entry: Entry | None
    others: Sequence[Corners]


@dataclass(frozen=True)
class Ends:
    """Poses in which to let go (n), and what each costs (n,) in metres of way."""

    poses: Poses
    costs: Array


def ends_of(goal: Goal, terrain: Terrain, stand: Stand, draw: Generator) -> Ends:
    """The best of many poses in which what is held would come to lie in or on a receptacle."""
    poses, costs = _drawn_above(goal, terrain.linkage, stand, draw)
    reached = np.flatnonzero(terrain.linkage.reached(poses))[:_RATED]
    poses, costs = poses[reached], costs[reached]
    held = terrain.linkage.held(poses)
    over = support(held, goal.places)
    costs = costs + _LOOSE * (1.0 - over) + _EDGE * (1.0 - firmness(held, goal.places))
    costs = costs + _TAKEN * taken(held, goal.places, goal.others)
    costs = costs + _MET * _beside_contacts(goal, held.center[:, 0], terrain.contacts)
    good = np.flatnonzero(over > 0)
    best = good[np.argsort(costs[good], kind="stable")][:_TESTED]
    best = best[terrain.free(poses[best])][:_KEPT]
    return Ends(poses[best], costs[best])


def _beside_contacts(goal: Goal, middles: Array, contacts: Sequence[Contact]) -> Array:
    """How often (n,) the receptacle was met where the middle of what is held would be; in an opening, on the way in."""
    found = np.zeros(len(middles))
    for contact in contacts:
        if contact.on_goal:
            apart = np.abs(middles - contact.held)
            found += (apart[:, 2 - goal.entry.axis] if goal.entry else np.hypot(apart[:, 0], apart[:, 2])) < _NEAR
    return found


def _drawn_above(goal: Goal, linkage: Linkage, stand: Stand, draw: Generator) -> tuple[Poses, Array]:
    """Poses (n) with what is held above places, and what they cost (n,) but for how it would lie."""
    points = _within_reach(goal.places.points, linkage)
    spots = _between(points[draw.integers(len(points), size=_DRAWN)], goal.places, draw)
    yaws, pitches = draw.choice(_YAWS, size=_DRAWN), draw.choice(_PITCHES, size=_DRAWN)
    yaws = np.where(draw.random(_DRAWN) < 1 / 2, yaws, draw.uniform(_YAWS[0], _YAWS[-1], size=_DRAWN))
    turns = heading(stand.heading + yaws, pitches)
    aloft = draw.choice(_ABOVE, size=_DRAWN)
    grounds, more = _grounds(goal, spots, draw)
    costs = _PITCHED * np.abs(pitches) + _TURNED * np.abs(yaws) + _DROP * aloft + more
    held = linkage.held(Poses(np.zeros((_DRAWN, 3)), np.zeros(_DRAWN), turns))
    lower = (np.abs(held.axes[:, 0, :, 1]) * held.half[:, 0]).sum(axis=1)
    wrists = np.stack([spots[:, 0], grounds + aloft + lower, spots[:, 2]], axis=1) - held.center[:, 0]
    bases = np.clip(wrists[:, 1] + draw.choice(_BASES, size=_DRAWN), stand.low, stand.high)
    wrists[:, 1] -= bases
    return Poses(wrists, bases, turns), costs


def _between(spots: Array, places: Places, draw: Generator) -> Array:
    """Places (n, 3) moved about by up to half their distance, not beyond the outermost unless there are few."""
    spacing = places.spacing
    low, high = places.points.min(axis=0), places.points.max(axis=0)
    margin = np.where(high - low < _FEW * spacing, _BEYOND * spacing, 0.0)
    moved = spots + spacing * draw.uniform(-1 / 2, 1 / 2, size=spots.shape) * (1.0, 0.0, 1.0)
    clipped: Array = np.clip(moved, low - margin, high + margin)
    return clipped


def _grounds(goal: Goal, spots: Array, draw: Generator) -> tuple[Array, Array]:
    """Heights (n,) above which to let go over some places (n, 3), and what that costs (n,)."""
    rim = goal.places.top
    if goal.entry is not None or rim < spots[:, 1].max() + _RIM:
        return spots[:, 1], np.zeros(len(spots))
    into = draw.random(len(spots)) < _INTO
    return np.where(into, spots[:, 1], rim), np.where(into, _BELOW_RIM, 0.0)


def _within_reach(points: Array, linkage: Linkage) -> Array:
    """Places to which what is held could be brought; all where none is."""
    apart = np.linalg.norm((points - linkage.shoulder)[:, [0, 2]], axis=1)
    near = points[apart <= linkage.reach + np.linalg.norm(linkage.lever)]
    return near if len(near) else points


def passed(goal: Goal, terrain: Terrain, stand: Stand, ends: Poses, count: int, draw: Generator) -> Poses:
    """Poses to pass: before and above those to come to, drawn in at all heights, around the present one, anywhere."""
    known = Poses.join([*_approaches(ends, goal.entry, stand), _folded(terrain.linkage, stand)])
    drawn = [_anywhere(terrain.linkage, stand, _WASTE * count, draw), _around(terrain.linkage, stand, count, draw)]
    return Poses.join([known[terrain.free(known)], *(poses[terrain.free(poses)][:count] for poses in drawn)])


def _approaches(ends: Poses, entry: Entry | None, stand: Stand) -> Iterator[Poses]:
    for up in _UP:
        yield Poses(ends.wrists, np.clip(ends.bases + up, stand.low, stand.high), ends.turns)
        yield Poses(ends.wrists + np.array([0.0, up, 0.0]), ends.bases, ends.turns)
    if entry is not None:
        for out in _OUT:
            yield Poses(ends.wrists + entry.out(out) + np.array([0.0, _CLEAR, 0.0]), ends.bases, ends.turns)


def _folded(linkage: Linkage, stand: Stand) -> Poses:
    """The arm drawn in, at some heights, with the hand turned to some sides."""
    heights = np.linspace(stand.low, stand.high, _N_HEIGHTS)
    made = np.array(list(itertools.product(_DRAWN_IN, heights, _FOLDED)))
    ahead = np.array([math.sin(stand.heading), 0.0, math.cos(stand.heading)])
    return Poses(
        linkage.shoulder + made[:, :1] * ahead, made[:, 1], heading(stand.heading + made[:, 2], np.zeros(len(made)))
    )


def _anywhere(linkage: Linkage, stand: Stand, count: int, draw: Generator) -> Poses:
    ways = draw.normal(size=(count, 3))
    ways *= (draw.uniform(0.05, linkage.reach, size=count) / np.linalg.norm(ways, axis=1))[:, None]
    yaws = stand.heading + draw.uniform(_YAWS[0], _YAWS[-1], size=count)
    pitches = np.where(draw.random(count) < _LEVEL, 0.0, draw.uniform(-math.pi / 4, math.pi / 2, size=count))
    return Poses(linkage.shoulder + ways, draw.uniform(stand.low, stand.high, size=count), heading(yaws, pitches))


def _around(linkage: Linkage, stand: Stand, count: int, draw: Generator) -> Poses:
    """Poses around the present one: where it is narrow, the way out begins with small movements."""
    now = linkage.now
    wrists = now.wrists + draw.normal(scale=_AROUND, size=(count, 3))
    bases = np.clip(now.bases + draw.normal(scale=2 * _AROUND, size=count), stand.low, stand.high)
    turns = heading(draw.normal(scale=1.0, size=count), np.zeros(count)) @ now.turns
    return Poses(wrists, bases, np.where((draw.random(count) < 1 / 2)[:, None, None], turns, now.turns))
