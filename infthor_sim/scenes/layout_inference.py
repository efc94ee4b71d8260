"""What recorded boxes do not say: fronts, hinges, drawers in desks, sinks in counters, knobs."""

from collections.abc import Iterator

import numpy as np

from infthor_sim.geometry import Array, aabb_overlap, yaw_matrix
from infthor_sim.objects import SimObject
from infthor_sim.physics.footprints import Rect, subtract
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.world import World

_BODY = np.array([0.2, 0.0, 0.2])  # half of the floor that the agent takes up, metres
# metres that a counter sticks out over its cabinets, and of free floor in front of them
_LIP = 0.02
_BEFORE = 0.6


def infer_layout(world: World) -> None:
    """Set fronts, hinges, outlines, hollows, knobs and surface heights of objects, in place."""
    items = list(world.objects.values())
    fixed = [o for o in items if not o.type.pickupable]
    for item in fixed:
        if item.type.faces_room:
            item.front = _front(item, world.nav)
        if item.type.encloses:
            item.hinge = _hinge(item)
    for item in fixed:
        item.pieces = _outline(item, fixed, world.nav) if item.type.has_cutouts else ()
        if item.object_type == "Cabinet":
            # A solid cabinet would fill a basin that hangs in it. A tub, which is no `open_top`,
            # has its own basin.
            item.hollow = any(
                o.type.basin and o.type.open_top > 0 and _overlaps(o, item) for o in fixed
            )
            continue
        item.hollow = item.type.receptacle and not item.type.built_in and any(
            other.type.built_in and other is not item and _is_inside(other, item) for other in fixed
        )  # fmt: skip
    _connect_knobs(items)
    _infer_supports(world)


def _front(item: SimObject, nav: NavGrid) -> float:
    """Return the front's yaw in the object's own frame, degrees: towards the most free floor."""
    low, high = item.bounds()
    center = (low + high) / 2
    half = (high - low) / 2
    hinge = item.position - center
    scores = []
    for angle in (0.0, 90.0, 180.0, 270.0):
        direction = np.round([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
        face = center + direction * half
        free = nav.count_free_ahead(face[0], face[2], angle)
        # A cabinet's origin is at its hinge, which is on its front: that counts more than any
        # amount of floor.
        at_face = float(hinge @ direction) >= float(np.abs(direction) @ half) - 0.08
        bonus = 100 if item.object_type == "Cabinet" and at_face else 0
        thin = float(np.abs(direction) @ half) <= min(half[0], half[2]) + 1e-6
        flat = 3 if thin and item.type.flat else 0
        # ties: the thin side, then the smaller angle
        scores.append((free + bonus + flat * 10, thin, -angle))
    best = max(scores)
    return (-best[2] - float(item.rotation[1])) % 360


def _hinge(item: SimObject) -> int:
    """Return the hinge's side from the front, -1 or 1: a cabinet's at its origin; others 1."""
    if item.object_type != "Cabinet":
        return 1
    angle = np.radians(float(item.rotation[1]) + item.front)
    aside = float((item.position - item.center) @ (np.cos(angle), 0.0, -np.sin(angle)))
    return 1 if aside > 0 else -1


def _overlaps(a: SimObject, b: SimObject) -> bool:
    """Return whether two boxes share more than a sliver."""
    return aabb_overlap(
        a.bounds()[0] + 0.02, a.bounds()[1] - 0.02, b.bounds()[0] + 0.02, b.bounds()[1] - 0.02
    )


def _is_inside(inner: SimObject, outer: SimObject) -> bool:
    low, high = outer.bounds()
    center = inner.center
    return bool(np.all((center > low - 0.02) & (center < high + 0.02)))


def _outline(item: SimObject, fixed: list[SimObject], nav: NavGrid) -> tuple[Rect, ...]:
    """Return an outline from above without sinks and, for counters, floor; empty: the whole box.

    A counter around a corner is recorded as one box. The agent's cells in it, and what its cabinets
    open on, are floor.
    """
    low, high = item.bounds()
    holes = [_own_frame(item, *box) for box in _sink_boxes(item, fixed)]
    if item.object_type == "CounterTop":
        for x, z in nav:
            if low[0] < x < high[0] and low[2] < z < high[2]:
                point = np.array([x, low[1], z])
                holes.append(_own_frame(item, point - _BODY, point + _BODY))
        holes += [_own_frame(item, *front) for front in _fronts_below(item, fixed)]
        holes += [
            _own_frame(item, *o.bounds()) for o in fixed if o.type.tall and _stands_through(o, item)
        ]
    half = item.box_size / 2
    whole = (-float(half[0]), -float(half[2]), float(half[0]), float(half[2]))
    return () if not holes else subtract(whole, holes)


def _stands_through(tall: SimObject, counter: SimObject) -> bool:
    """Return whether something reaches from well below a counter to well above it."""
    low, high = tall.bounds()
    return bool(low[1] < counter.bounds()[0][1] - 0.3 and high[1] > counter.bounds()[1][1] + 0.3)


def _sink_boxes(item: SimObject, fixed: list[SimObject]) -> Iterator[tuple[Array, Array]]:
    low, high = item.bounds()
    sinks = {"SinkBasin"} if item.object_type == "Sink" else {"Sink", "SinkBasin"}
    for other in fixed:
        if other.object_type not in sinks or other is item:
            continue
        o_low, o_high = other.bounds()
        if o_low[1] - 0.1 <= high[1] and o_high[1] + 0.3 >= low[1]:
            yield o_low, o_high


def _fronts_below(counter: SimObject, fixed: list[SimObject]) -> Iterator[tuple[Array, Array]]:
    """Yield the corners of boxes over the floor before cabinets and drawers below a counter."""
    high = counter.bounds()[1]
    for other in fixed:
        if other.object_type not in {"Cabinet", "Drawer"}:
            continue
        o_low, o_high = other.bounds()
        if o_high[1] > high[1] + 0.05 or high[1] - o_high[1] > 0.5:
            continue  # above the counter, or of other furniture
        ahead = np.round(yaw_matrix(float(other.rotation[1]) + other.front)[:, 2])
        # Along the axis of the front the box goes from the lip to the free floor; across it, it is
        # the cabinet's.
        start, end = o_low + ahead * (_LIP + (o_high - o_low)), o_high + ahead * _BEFORE
        yield (
            np.minimum(start, end) * np.abs(ahead) + o_low * (1 - np.abs(ahead)),
            np.maximum(start, end) * np.abs(ahead) + o_high * (1 - np.abs(ahead)),
        )


def _own_frame(item: SimObject, low: Array, high: Array) -> Rect:
    """Return the rectangle of a box, given by its corners, in an object's own frame."""
    points = (np.array([low, high]) - item.center) @ item.matrix
    a = points.min(axis=0)
    b = points.max(axis=0)
    return float(a[0]), float(a[2]), float(b[0]), float(b[2])


def _connect_knobs(items: list[SimObject]) -> None:
    """Let each stove knob control a burner: both are ordered along the row of knobs."""
    knobs = [o for o in items if o.object_type == "StoveKnob"]
    burners = [o for o in items if o.object_type == "StoveBurner"]
    if not knobs or not burners or any(k.controls for k in knobs):
        return
    axis = int(np.argmax(np.ptp([k.position for k in knobs], axis=0) * (1.0, 0.0, 1.0)))
    other = 2 - axis
    knobs.sort(key=lambda o: (float(o.position[axis]), o.object_id))
    # Rounding makes burners one behind the other tie, so that their depth decides.
    burners.sort(key=lambda o: (round(float(o.position[axis]), 1), float(o.position[other])))
    for index, knob in enumerate(knobs):
        knob.controls = (burners[index * len(burners) // len(knobs)].object_id,)


def _infer_supports(world: World) -> None:
    """Set surface heights of tables and seats to where things lie; boxes have backs and rims."""
    lying: dict[str, list[float]] = {}
    for item in world.objects.values():
        if item.type.pickupable:
            low, high = item.bounds()
            middle = (low + high) / 2
            for other in world.objects.values():
                elsewhere = item.parent not in (None, other.object_id)
                if other.type.infer_support and not elsewhere and _is_on(middle, other):
                    lying.setdefault(other.object_id, []).append(float(low[1]))
    for object_id, heights in lying.items():
        furniture = world.objects[object_id]
        low, high = furniture.bounds()
        # The median, as a few things lie on the back or below the seat.
        level = float(np.median(heights)) - float(low[1])
        usual = furniture.surface_height() - float(low[1])
        if 0.2 * (high[1] - low[1]) < level < high[1] - low[1] - 0.05 and abs(level - usual) > 0.04:
            furniture.support = level


def _is_on(point: Array, furniture: SimObject) -> bool:
    low, high = furniture.bounds()
    return bool(
        low[0] < point[0] < high[0]
        and low[2] < point[2] < high[2]
        and low[1] < point[1] < high[1] + 0.1
    )
