"""What a scene's objects are to each other: fronts, hinges, drawers in desks, sinks in counters, knobs of burners."""

from collections.abc import Iterator

import numpy as np

from infthor_eval.sim.footprints import Rect, without
from infthor_eval.sim.geometry import Array, aabb_overlap, yaw_matrix
from infthor_eval.sim.navigation import NavGrid
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.world import World

__all__ = ["arrange"]

_BODY = np.array([0.2, 0.0, 0.2])  # half of the floor that the agent takes, metres
_LIP, _BEFORE = 0.02, 0.6  # how far a counter reaches over its cabinets, and how far before them is floor, metres


def arrange(world: World) -> None:
    """Works out, in place, what a list of boxes does not tell."""
    items = list(world.objects.values())
    fixed = [o for o in items if not o.type.pickupable]
    for item in fixed:
        if item.type.faces_room:
            item.front = _front(item, world.nav)
        if item.type.encloses:
            item.hinge = _hinge(item)
    for item in fixed:
        item.pieces = _plan(item, fixed, world.nav) if item.type.cut_out else ()
        if item.object_type == "Cabinet":
            item.hollow = any(_hangs(o) and _cuts(o, item) for o in fixed)
            continue
        item.hollow = item.type.receptacle and not item.type.fitted and any(
            other.type.fitted and other is not item and _inside(other, item) for other in fixed
        )  # fmt: skip
    _connect_knobs(items)
    _raise_supports(world)


def _front(item: SimObject, nav: NavGrid) -> float:
    """Yaw of the front in the object's own frame: towards the free floor; a cabinet's hinge narrows the choice."""
    low, high = item.bounds()
    center, half = (low + high) / 2, (high - low) / 2
    hinge = item.position - center
    scores = []
    for angle in (0.0, 90.0, 180.0, 270.0):
        direction = np.round([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
        face = center + direction * half
        free = nav.freedom(face[0], face[2], angle)
        at_face = float(hinge @ direction) >= float(np.abs(direction) @ half) - 0.08
        bonus = 100 if item.object_type == "Cabinet" and at_face else 0
        thin = float(np.abs(direction) @ half) <= min(half[0], half[2]) + 1e-6
        flat = 3 if thin and item.type.flat else 0
        scores.append((free + bonus + flat * 10, thin, -angle))
    best = max(scores)
    return (-best[2] - float(item.rotation[1])) % 360


def _hinge(item: SimObject) -> int:
    """The side of the hinge, seen in the frame of the front: where a cabinet's origin is; left for other doors."""
    if item.object_type != "Cabinet":
        return 1
    angle = np.radians(float(item.rotation[1]) + item.front)
    aside = float((item.position - item.center) @ (np.cos(angle), 0.0, -np.sin(angle)))
    return 1 if aside > 0 else -1


def _hangs(item: SimObject) -> bool:
    """Whether it is a basin that hangs in a cabinet or counter; a bathtub is solid around its own basin."""
    return item.type.basin and item.type.open_top > 0


def _cuts(a: SimObject, b: SimObject) -> bool:
    """Whether two boxes share more than a sliver."""
    return aabb_overlap(a.bounds()[0] + 0.02, a.bounds()[1] - 0.02, b.bounds()[0] + 0.02, b.bounds()[1] - 0.02)


def _inside(inner: SimObject, outer: SimObject) -> bool:
    low, high = outer.bounds()
    center = inner.center
    return bool(np.all((center > low - 0.02) & (center < high + 0.02)))


def _plan(item: SimObject, fixed: list[SimObject], nav: NavGrid) -> tuple[Rect, ...]:
    """The object's plan less the sinks in it and, of counters, less the floor in front of what is below them.

    A counter around a corner is recorded as one box; where the agent stands, and what its cabinets open on, is floor.
    """
    low, high = item.bounds()
    holes = [_own_frame(item, *cut) for cut in _sinks(item, fixed)]
    if item.object_type == "CounterTop":
        for x, z in nav:
            if low[0] < x < high[0] and low[2] < z < high[2]:
                point = np.array([x, low[1], z])
                holes.append(_own_frame(item, point - _BODY, point + _BODY))
        holes += [_own_frame(item, *front) for front in _fronts_below(item, fixed)]
        holes += [_own_frame(item, *o.bounds()) for o in fixed if o.type.tall and _stands_through(o, item)]
    half = item.box_size / 2
    whole = (-float(half[0]), -float(half[2]), float(half[0]), float(half[2]))
    return () if not holes else without(whole, holes)


def _stands_through(tall: SimObject, counter: SimObject) -> bool:
    """Whether something goes from well below a counter to well above it."""
    low, high = tall.bounds()
    return bool(low[1] < counter.bounds()[0][1] - 0.3 and high[1] > counter.bounds()[1][1] + 0.3)


def _sinks(item: SimObject, fixed: list[SimObject]) -> Iterator[tuple[Array, Array]]:
    low, high = item.bounds()
    wanted = {"SinkBasin"} if item.object_type == "Sink" else {"Sink", "SinkBasin"}
    for other in fixed:
        if other.object_type not in wanted or other is item:
            continue
        o_low, o_high = other.bounds()
        if o_low[1] - 0.1 <= high[1] and o_high[1] + 0.3 >= low[1]:
            yield o_low, o_high


def _fronts_below(counter: SimObject, fixed: list[SimObject]) -> Iterator[tuple[Array, Array]]:
    """The floor before the cabinets and drawers that stand below a counter."""
    high = counter.bounds()[1]
    for other in fixed:
        if other.object_type not in {"Cabinet", "Drawer"}:
            continue
        o_low, o_high = other.bounds()
        if o_high[1] > high[1] + 0.05 or high[1] - o_high[1] > 0.5:
            continue
        ahead = np.round(yaw_matrix(float(other.rotation[1]) + other.front)[:, 2])
        start, end = o_low + ahead * (_LIP + (o_high - o_low)), o_high + ahead * _BEFORE
        yield (
            np.minimum(start, end) * np.abs(ahead) + o_low * (1 - np.abs(ahead)),
            np.maximum(start, end) * np.abs(ahead) + o_high * (1 - np.abs(ahead)),
        )


def _own_frame(item: SimObject, low: Array, high: Array) -> tuple[float, float, float, float]:
    points = (np.array([low, high]) - item.center) @ item.matrix
    a, b = points.min(axis=0), points.max(axis=0)
    return float(a[0]), float(a[2]), float(b[0]), float(b[2])


def _connect_knobs(items: list[SimObject]) -> None:
    """Each stove knob controls a burner: knobs from left to right, burners in the same order."""
    knobs = [o for o in items if o.object_type == "StoveKnob"]
    burners = [o for o in items if o.object_type == "StoveBurner"]
    if not knobs or not burners or any(k.controls for k in knobs):
        return
    axis = int(np.argmax(np.ptp([k.position for k in knobs], axis=0) * (1.0, 0.0, 1.0)))
    other = 2 - axis
    knobs.sort(key=lambda o: (float(o.position[axis]), o.object_id))
    burners.sort(key=lambda o: (round(float(o.position[axis]), 1), float(o.position[other])))
    for index, knob in enumerate(knobs):
        knob.controls = (burners[index * len(burners) // len(knobs)].object_id,)


def _raise_supports(world: World) -> None:
    """Learn from what lies on a table or seat, where its box does not tell, how high its surface is."""
    lying: dict[str, list[float]] = {}
    for item in world.objects.values():
        if item.type.pickupable:
            low, high = item.bounds()
            middle = (low + high) / 2
            for other in world.objects.values():
                if other.type.yields and _over(other, middle):
                    lying.setdefault(other.object_id, []).append(float(low[1]))
    for object_id, heights in lying.items():
        owner = world.objects[object_id]
        low, high = owner.bounds()
        level = float(np.median(heights)) - float(low[1])
        usual = (float(high[1]) if owner.support is None else float(low[1]) + owner.support) - float(low[1])
        if 0.2 * (high[1] - low[1]) < level < high[1] - low[1] - 0.05 and abs(level - usual) > 0.04:
            owner.support = level


def _over(owner: SimObject, point: Array) -> bool:
    low, high = owner.bounds()
    return bool(low[0] < point[0] < high[0] and low[2] < point[2] < high[2] and low[1] < point[1] < high[1] + 0.1)
