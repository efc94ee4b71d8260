"""Two worlds in which two things are brought from two places to one surface, and end alike.

In the second world the things have exchanged their places at the start, and so the order in which
they are brought; both stand in the end where they do in the first. The agent walks away, looks
around, and comes back to where an arm reaches both.
"""

import math
import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, islice, permutations
from typing import Any

from msgspec.structs import replace

from infthor_eval.formats.trajectory import Scene
from infthor_eval.generation.rollout import Rollout
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.generation.twins.exchanges import restored_ids
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.generation.twins.placing import may_fit, scenes_of_both
from infthor_eval.generation.walking import Walker
from infthor_eval.household.affordances import goes_into
from infthor_eval.household.containment import direct_parent
from infthor_eval.household.navigation import Grid, GridPose
from infthor_eval.household.scout import Viewpoint, grid_pose_of, reachable_grid, view_from
from infthor_eval.household.wording import canonical_type
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import NO_RENDERING, Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject, teleport_call

_SURFACES = ("CoffeeTable", "CounterTop", "Desk", "DiningTable", "Dresser", "SideTable", "TVStand")
_TAIL = 10  # actions at least of which no picture tells the worlds apart
_NEAR_SURFACE = 0.6  # metres from a surface at most, where the agent stands to put
_BETWEEN_STANDS = (0.5, 1.3)  # metres between the two places to put from
_ARM = 0.85  # metres over the floor from the agent at most, within which things must end
_HORIZON = 30  # degrees that the camera is lowered where things are put
_HORIZONS = (30, 60, 0)  # and in the end, in the order in which they are tried
_APART = 50  # pixels between the middles of both things in the last frame, at least
_MIN_PIXELS = 90  # of either, of 90,000
_SIDE = 300  # pixels of a frame
_MOST_TRIALS = 4  # pairs of stands for two things and a surface


@dataclass(frozen=True)
class Errand:
    """Two things, the places that they exchange, and the surface that they are brought to.

    Attributes:
        things: the things, as they are at the start of the base; each is at its own place.
        places: what they are on or in.
        surface: what both are brought to.
    """

    things: tuple[ThorObject, ThorObject]
    places: tuple[ThorObject, ThorObject]
    surface: ThorObject


@dataclass(frozen=True)
class Brought:
    """A world.

    Attributes:
        scene: its start.
        trace: what was done.
        view: the world at the end.
        things: ids of both things, as in the errand.
        order: numbers of the things in the order in which they were brought.
        taken: actions by which these were picked up, by number from 0.
        put: actions by which they were put down.
        tail: number of actions at the end of which no picture tells the worlds apart.
        end: where the agent stands in the end.
    """

    scene: Scene
    trace: Trace
    view: SimulatorView
    things: tuple[str, str]
    order: tuple[int, int]
    taken: tuple[int, int]
    put: tuple[int, int]
    tail: int
    end: Viewpoint


def errands(view: SimulatorView, rng: random.Random) -> list[Errand]:
    """Return what a room has for such worlds, in random order."""
    objects = view.objects
    surfaces = [obj for obj in objects.values() if obj.object_type in _SURFACES]
    holders = {parent for obj in objects.values() for parent in obj.parent_receptacles or ()}
    loose = []
    for obj in objects.values():
        parent = direct_parent(obj, objects)
        if obj.pickupable and obj.object_id not in holders and parent is not None:
            loose.append((obj, objects[parent]))
    counts = Counter(canonical_type(obj.object_type) for obj in objects.values())
    alone = [pair for pair in loose if counts[canonical_type(pair[0].object_type)] == 1]
    found = [
        Errand((one, other), (place, there), surface)
        for (one, place), (other, there) in combinations(alone, 2)
        if _may_exchange(one, place, other, there, view)
        for surface in surfaces
        if surface.object_type not in (place.object_type, there.object_type)
        and all(goes_into(obj.object_type, surface.object_type) for obj in (one, other))
    ]
    rng.shuffle(found)
    return found


def _may_exchange(
    one: ThorObject, place: ThorObject, other: ThorObject, there: ThorObject, view: SimulatorView
) -> bool:
    if canonical_type(place.object_type) == canonical_type(there.object_type):
        return False
    if place.pickupable or there.pickupable:
        return False
    fits = goes_into(one.object_type, there.object_type) and goes_into(
        other.object_type, place.object_type
    )
    return fits and may_fit(one, other, view.objects) and may_fit(other, one, view.objects)


def bring(
    errand: Errand, scene: Scene, simulator: Simulator, rng: random.Random
) -> tuple[Brought, Brought]:
    """Return both worlds.

    Raises:
        EditRefused: the room or the simulator does not allow it; the message is the reason.
        SimulatorError: the simulator fails.
    """
    puts_of_both = list(islice(_stands(errand, scene, simulator, rng), _MOST_TRIALS))
    if not puts_of_both:
        raise EditRefused("no two places to put from")
    one, other = errand.things
    scenes = scenes_of_both(scene, simulator, [(one, (one, other)), (other, (other, one))])
    first = rng.randrange(2)  # the place from which a thing is brought first
    reason = ""
    for puts in puts_of_both:
        try:
            here = _carry_out(errand, scenes[0], (first, 1 - first), puts, None, simulator)
            there = _carry_out(errand, scenes[1], (1 - first, first), puts, here.end, simulator)
            _check_alike(here, there)
        except (EditRefused, RolloutError) as error:
            reason = str(error).partition(":")[0]
        else:
            return here, there
    raise EditRefused(reason)


def _carry_out(
    errand: Errand,
    scene: Scene,
    order: tuple[int, int],
    puts: tuple[Viewpoint, Viewpoint],
    end: Viewpoint | None,
    simulator: Simulator,
) -> Brought:
    """Bring both things in this order, each to its own spot, and come back; where it ends is found
    if it is not known yet."""
    ids = restored_ids(simulator, scene, errand.things)
    things = ids[errand.things[0].name], ids[errand.things[1].name]
    surface = errand.surface.object_id
    grid = reachable_grid(simulator)
    agent = simulator.view.agent
    begin = Viewpoint(grid_pose_of(agent, grid), round(agent.horizon))
    trace = Trace(simulator)
    walker = Walker(trace)
    rollout = Rollout(trace, walker)
    taken, put = [], []
    for number in order:
        rollout.fetch(things[number])
        taken.append(len(trace.actions) - 1)
        walker.stand(puts[number], surface)
        rollout.put_here(things[number], surface)
        put.append(len(trace.actions) - 1)
    if end is None:
        end = _end(simulator, things)
    walker.stand(begin, surface)
    n_before = len(trace.actions)
    walker.turn_around()
    walker.stand(end, surface)
    tail = len(trace.actions) - n_before
    if tail < _TAIL:
        raise EditRefused("the agent begins too near")
    handled = (taken[0], taken[1]), (put[0], put[1])
    return Brought(scene, trace, simulator.view, things, order, *handled, tail, end)


def _stands(
    errand: Errand, scene: Scene, simulator: Simulator, rng: random.Random
) -> Iterator[tuple[Viewpoint, Viewpoint]]:
    """Yield pairs of poses from which the surface is seen, side by side, in random order."""
    restore(simulator, scene)
    grid = reachable_grid(simulator)
    poses = [
        Viewpoint(GridPose(cell, facing), _HORIZON)
        for cell in sorted(grid.cells)
        for facing in (0, 90, 180, 270)
        if _faces(grid.position(cell), facing, errand.surface)
    ]
    pairs = [pair for pair in permutations(poses, 2) if _side_by_side(grid, *pair)]
    rng.shuffle(pairs)
    for pair in pairs[: 4 * _MOST_TRIALS]:
        views = [_seen_from(simulator, grid, one, **NO_RENDERING) for one in pair]
        if all(view.success and view.objects[errand.surface.object_id].visible for view in views):
            yield pair


def _side_by_side(grid: Grid, one: Viewpoint, other: Viewpoint) -> bool:
    least, most = _BETWEEN_STANDS
    apart = math.dist(grid.position(one.pose.cell), grid.position(other.pose.cell))
    return one.pose.facing == other.pose.facing and least <= apart <= most


def _beside(at: float, middle: float, width: float) -> float:
    """Return how far it is along an axis from a place to what is so wide; 0 within."""
    low, high = middle - width / 2, middle + width / 2
    return max(low - at, 0.0) + min(high - at, 0.0)


def _faces(position: tuple[float, float], facing: int, surface: ThorObject) -> bool:
    """Return True if an agent there is near a surface and looks at it."""
    box = surface.axis_aligned_bounding_box
    assert box is not None  # a surface of the simulator has one
    away = (
        _beside(position[0], box.center.x, box.size.x),
        _beside(position[1], box.center.z, box.size.z),
    )
    ahead = math.sin(math.radians(facing)), math.cos(math.radians(facing))
    distance = math.hypot(*away)
    along = away[0] * ahead[0] + away[1] * ahead[1]
    return 0 < distance <= _NEAR_SURFACE and along > 0.9 * distance


def _end(simulator: Simulator, things: tuple[str, str]) -> Viewpoint:
    """Return where an arm reaches both things, which are seen side by side.

    Raises:
        EditRefused: there is no such pose.
    """
    view = simulator.view
    grid = reachable_grid(simulator)
    positions = [view.objects[key].position for key in things]
    middle = [sum(axis) / 2 for axis in zip(*((at.x, at.z) for at in positions), strict=True)]
    ranked = sorted(
        (max(math.dist(grid.position(cell), (at.x, at.z)) for at in positions), cell)
        for cell in grid.cells
    )
    for distance, cell in ranked:
        if distance > _ARM:
            break
        x, z = grid.position(cell)
        bearing = math.degrees(math.atan2(middle[0] - x, middle[1] - z))
        facing = round(bearing / 90) * 90 % 360
        for horizon in _HORIZONS:
            viewpoint = Viewpoint(GridPose(cell, facing), horizon)
            seen = _seen_from(simulator, grid, viewpoint, renderImage=False)
            if seen.success and _sides(seen, things) is not None:
                return viewpoint
    raise EditRefused("no place from which both are seen and reached")


def left_one(view: SimulatorView, things: tuple[str, str]) -> int:
    """Return which of two things is the left one in a frame."""
    left = _sides(view, things)
    assert left is not None  # it was checked
    return left


def _sides(view: SimulatorView, things: tuple[str, str]) -> int | None:
    """Return which of two things is on the left; None if either is not seen well, or beside."""
    instances = view.instances or {}
    found = [instances.get(key) for key in things]
    middles = []
    for instance in found:
        if instance is None or instance.pixels < _MIN_PIXELS:
            return None
        left, top, right, bottom = instance.box
        if left <= 0 or top <= 0 or right >= _SIDE - 1 or bottom >= _SIDE - 1:
            return None
        middles.append((left + right) / 2)
    if abs(middles[0] - middles[1]) < _APART:
        return None
    return int(middles[1] < middles[0])


def _seen_from(
    simulator: Simulator, grid: Grid, viewpoint: Viewpoint, **rendering: Any
) -> SimulatorView:
    """Return what an agent sees from a pose; it is brought back."""
    start = simulator.view
    seen = view_from(simulator, grid, start, viewpoint, rendering)
    simulator.query(**{**teleport_call(start.agent), **NO_RENDERING})
    return seen


def _check_alike(here: Brought, there: Brought) -> None:
    """Raise EditRefused unless both worlds end alike."""
    if here.view.agent != there.view.agent:
        raise EditRefused("the agent ends elsewhere")
    if _states(here.view) != _states(there.view):
        raise EditRefused("the things end elsewhere")
    if here.tail != there.tail:
        raise EditRefused("the ways back differ")


def _states(view: SimulatorView) -> dict[str, ThorObject]:
    """Return what there is by name, but for ids and what depends on the agent."""
    return {
        obj.name: replace(
            obj,
            object_id="",
            distance=0.0,
            visible=False,
            parent_receptacles=None,
            receptacle_object_ids=None,
        )
        for obj in view.objects.values()
    }
