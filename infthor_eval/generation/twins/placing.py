"""Giving objects each other's places in a restored scene, and the scene that results."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import msgspec
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import ObjectPose, Scene
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.generation.twins.tolerance import tolerance_of
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Box, SimulatorView, ThorObject, Vector

__all__ = ["may_fit", "moved_scene", "scene_of"]

# Places beside the other's that are tried, nearest first, metres.
_STEPS = [step / 20 for step in range(-5, 6)]
_OFFSETS = sorted(product(_STEPS, _STEPS), key=lambda offset: math.hypot(*offset))
_SLACK = 0.01  # how far the new object may reach beyond a container, metres
_WIDER = 0.15  # how much wider it may be elsewhere, metres
_FAR = 50.0  # metres above the room, where objects wait for their new places


def moved_scene(
    scene: Scene,
    simulator: Simulator,
    moves: Sequence[tuple[ThorObject, ThorObject]],
    aside: Sequence[ThorObject] = (),
) -> Scene:
    """Move objects to the places of others in a restored scene; return it as trajectories have it.

    Args:
        scene: the scene, which is restored first.
        simulator: a simulator.
        moves: each object, and the one at whose place it is to be.
        aside: further objects that are taken out of the way, above the room.

    Raises:
        EditRefused: there is no room, or a third object moved or is elsewhere.
        SimulatorError: the simulator fails.
    """
    restore(simulator, scene)
    before = simulator.view.objects
    # What goes aside first, so that it is at the same place whatever is moved.
    lifted = [*aside, *(_turned(item, where) for item, where in moves)]
    for number, item in enumerate(lifted):
        _lift(simulator, item, {"x": 0.0, "y": _FAR + number, "z": 0.0})
    waiting = simulator.view.objects
    for item, where in moves:
        _place(simulator, waiting[item.object_id], where, before)
    after = simulator.view.objects
    moved = {item.object_id for item in lifted}
    tolerance = tolerance_of(simulator)
    for key, obj in before.items():
        if key not in moved and obj.parent_receptacles != after[key].parent_receptacles:
            raise EditRefused("the move changed what a third object is in or on")
        if key not in moved and not tolerance.is_same_place(obj.position, after[key].position):
            raise EditRefused("the move moved a third object")
    if not all(_has_place(simulator.view, item, where) for item, where in moves):
        raise EditRefused("an object is not where the other was")
    return scene_of(scene, simulator.view)


def scene_of(scene: Scene, view: SimulatorView) -> Scene:
    """Return a scene with the poses of all that can be picked up in a view, sorted by name."""
    poses = [
        ObjectPose(obj.name, asdict(obj.position), asdict(obj.rotation))
        for obj in sorted(view.objects.values(), key=lambda obj: obj.name)
        if obj.pickupable
    ]
    return msgspec.structs.replace(scene, object_poses=poses)


def may_fit(item: ThorObject, where: ThorObject, objects: Mapping[str, ThorObject]) -> bool:
    """Return True if an object is not too large for the place of another one."""
    own = _turned(item, where).axis_aligned_bounding_box
    other = where.axis_aligned_bounding_box
    if own is None or other is None:
        return False
    container = _container(where, objects)
    if container is None:
        return max(own.size.x - other.size.x, own.size.z - other.size.z) <= _WIDER
    return any(_is_within(box, container) for box in _boxes_beside(own, other))


def _turned(item: ThorObject, where: ThorObject) -> ThorObject:
    """Return an object as it stands at another one's place: in line with what it stands on.

    Rooms are generated and recorded so; an object in its old rotation would tell the moved one.
    """
    rotation = msgspec.structs.replace(item.rotation, y=where.rotation.y)
    box = item.axis_aligned_bounding_box
    turn = abs(where.rotation.y - item.rotation.y) % 180
    if box is not None and abs(turn - 90) < 45:
        size = msgspec.structs.replace(box.size, x=box.size.z, z=box.size.x)
        box = msgspec.structs.replace(box, size=size)
    return msgspec.structs.replace(item, rotation=rotation, axis_aligned_bounding_box=box)


def _container(where: ThorObject, objects: Mapping[str, ThorObject]) -> Box | None:
    """Return the box of the container or basin that an object is in.

    All of its inside is its body to the simulator, which places nothing there by itself.
    """
    parents = [objects[key] for key in where.parent_receptacles or () if key in objects]
    boxes = [
        parent.axis_aligned_bounding_box
        for parent in parents
        if (parent.openable and parent.object_type != "Toilet")
        or parent.object_type.endswith("Basin")
    ]
    known = [box for box in boxes if box is not None]
    return min(known, key=lambda box: box.size.x * box.size.y * box.size.z, default=None)


def _boxes_beside(own: Box, other: Box) -> Iterator[Box]:
    """Yield the box of an object that stands where another one stands, then beside it."""
    bottom = other.center.y - other.size.y / 2
    for x, z in _OFFSETS:
        center = Vector(other.center.x + x, bottom + own.size.y / 2, other.center.z + z)
        yield msgspec.structs.replace(own, center=center)


def _is_within(inner: Box, outer: Box) -> bool:
    away = _distances(inner, outer)
    return all(
        away[axis] + getattr(inner.size, axis) / 2 <= getattr(outer.size, axis) / 2 + _SLACK
        for axis in away
    )


def _meet(one: Box, other: Box) -> bool:
    away = _distances(one, other)
    return all(
        away[axis] < (getattr(one.size, axis) + getattr(other.size, axis)) / 2 for axis in away
    )


def _distances(one: Box, other: Box) -> dict[str, float]:
    """Return how far the middles of two boxes are from each other along each axis."""
    return {axis: abs(getattr(one.center, axis) - getattr(other.center, axis)) for axis in "xyz"}


def _place(
    simulator: Simulator, item: ThorObject, where: ThorObject, before: Mapping[str, ThorObject]
) -> None:
    """Stand an object where another one stood, or as near to it as there is room.

    Args:
        simulator: simulator with the restored scene.
        item: the object, in the rotation that it is to have.
        where: the other one, before it was moved.
        before: the objects before any was moved.
    """
    box = where.axis_aligned_bounding_box
    own = item.axis_aligned_bounding_box
    if box is None or own is None:
        raise EditRefused("the simulator does not report boxes")
    container = _container(where, before)
    if container is not None:
        _put_inside(simulator, item, where, container)
        return
    bottom = box.center.y - box.size.y / 2
    point = {"x": where.position.x, "y": bottom, "z": where.position.z}
    for x, z in _OFFSETS:
        view = simulator.step(
            "PlaceObjectAtPoint",
            objectId=item.object_id,
            position={**point, "x": point["x"] + x, "z": point["z"] + z},
        )
        if view.success and _has_place(view, item, where):
            return
    raise EditRefused("no room at the other's place")


def _put_inside(simulator: Simulator, item: ThorObject, where: ThorObject, container: Box) -> None:
    """Put an object into a container where another one was, or beside, clear of what is there."""
    own = item.axis_aligned_bounding_box
    other = where.axis_aligned_bounding_box
    assert own is not None
    assert other is not None
    others = [
        obj.axis_aligned_bounding_box
        for obj in simulator.view.objects.values()
        if obj.pickupable and obj.object_id != item.object_id
    ]
    for box in _boxes_beside(own, other):
        is_clear = not any(taken is not None and _meet(box, taken) for taken in others)
        if not is_clear or not _is_within(box, container):
            continue
        position = {
            axis: getattr(item.position, axis)
            - getattr(own.center, axis)
            + getattr(box.center, axis)
            for axis in "xyz"
        }
        _lift(simulator, item, position)
        if _has_place(simulator.view, item, where):
            return
    raise EditRefused("no room at the other's place")


def _lift(simulator: Simulator, item: ThorObject, position: dict[str, float]) -> None:
    """Give an object a position, in the air too."""
    simulator.step(
        "TeleportObject",
        objectId=item.object_id,
        position=position,
        rotation=asdict(item.rotation),
        forceAction=True,
        forceKinematic=True,
    )


def _has_place(view: SimulatorView, item: ThorObject, where: ThorObject) -> bool:
    """Return True if an object is in or on what another one was in or on."""
    parents = view.objects[item.object_id].parent_receptacles or []
    return set(parents) == set(where.parent_receptacles or [])
