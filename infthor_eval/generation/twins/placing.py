"""Giving objects each other's places in a restored scene, and the scene that results."""

import math
from collections.abc import Mapping, Sequence
from itertools import product

import msgspec
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import ObjectPose, Scene
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Box, SimulatorView, ThorObject, Vector

__all__ = ["may_fit", "moved_scene", "scene_of"]

# Places beside the other's that are tried, nearest first, metres.
_STEPS = [step / 20 for step in range(-5, 6)]
_OFFSETS = sorted(product(_STEPS, _STEPS), key=lambda offset: math.hypot(*offset))
_SLACK = 0.05  # how much larger the new object may be in a container, metres
_WIDER = 2.5  # how many times as wide it may be elsewhere
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
    lifted = [*(item for item, _ in moves), *aside]
    for number, item in enumerate(lifted):
        _lift(simulator, item, {"x": 0.0, "y": _FAR + number, "z": 0.0})
    for item, where in moves:
        _place(simulator, item, where, before)
    after = simulator.view.objects
    moved = {item.object_id for item in lifted}
    for key, obj in before.items():
        if key not in moved and obj.parent_receptacles != after[key].parent_receptacles:
            raise EditRefused("the move changed what a third object is in or on")
        if key not in moved and obj.position != after[key].position:
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
    """Return True if an object is so large that there may be room for it where another one is."""
    own = _size(item)
    other = _size(where)
    if own is None or other is None:
        return False
    if _is_enclosed(where, objects):
        more = own.x - other.x, own.y - other.y, own.z - other.z
        return max(more) <= _SLACK
    return max(own.x / other.x, own.z / other.z) <= _WIDER


def _size(obj: ThorObject) -> Vector | None:
    box = obj.axis_aligned_bounding_box
    return None if box is None else box.size


def _is_enclosed(obj: ThorObject, objects: Mapping[str, ThorObject]) -> bool:
    """Return True if an object is in a container or a basin, all of whose inside is its body."""
    parents = [objects[key] for key in obj.parent_receptacles or () if key in objects]
    return any(parent.openable or parent.object_type.endswith("Basin") for parent in parents)


def _place(
    simulator: Simulator, item: ThorObject, where: ThorObject, before: Mapping[str, ThorObject]
) -> None:
    """Stand an object where another one stood, or as near to it as there is room.

    Args:
        simulator: simulator with the restored scene.
        item: the object.
        where: the other one, before it was moved.
        before: the objects before any was moved.
    """
    box = where.axis_aligned_bounding_box
    own = item.axis_aligned_bounding_box
    if box is None or own is None:
        raise EditRefused("the simulator does not report boxes")
    bottom = box.center.y - box.size.y / 2
    point = {"x": where.position.x, "y": bottom, "z": where.position.z}
    if _is_enclosed(where, before):
        height = item.position.y - (own.center.y - own.size.y / 2)
        _lift(simulator, item, {**point, "y": bottom + height})
        if _has_place(simulator.view, item, where) and not _overlaps(simulator.view, item):
            return
        raise EditRefused("no room at the other's place")
    for x, z in _OFFSETS:
        view = simulator.step(
            "PlaceObjectAtPoint",
            objectId=item.object_id,
            position={**point, "x": point["x"] + x, "z": point["z"] + z},
        )
        if view.success and _has_place(view, item, where):
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


def _overlaps(view: SimulatorView, item: ThorObject) -> bool:
    """Return True if the box of an object meets that of another one that can be carried."""
    others = (obj for obj in view.objects.values() if obj.pickupable)
    placed = view.objects[item.object_id].axis_aligned_bounding_box
    boxes = (obj.axis_aligned_bounding_box for obj in others if obj.object_id != item.object_id)
    return placed is None or any(box is not None and _meet(placed, box) for box in boxes)


def _meet(one: Box, other: Box) -> bool:
    centers = asdict(one.center), asdict(other.center)
    sizes = asdict(one.size), asdict(other.size)
    return all(
        2 * abs(centers[0][axis] - centers[1][axis]) < sizes[0][axis] + sizes[1][axis]
        for axis in ("x", "y", "z")
    )
