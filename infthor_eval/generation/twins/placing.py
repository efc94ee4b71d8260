"""Giving objects each other's places in a restored scene, and the scene that results."""

import math
from collections.abc import Sequence
from itertools import product

import msgspec
from msgspec.structs import asdict

from infthor_eval.formats.trajectory import ObjectPose, Scene
from infthor_eval.generation.twins.kinds import EditRefused
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["moved_scene", "scene_of", "size_ratio"]

# Places beside the other's that are tried, nearest first, metres.
_STEPS = [step / 20 for step in range(-5, 6)]
_OFFSETS = sorted(product(_STEPS, _STEPS), key=lambda offset: math.hypot(*offset))
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
        simulator.step(
            "TeleportObject",
            objectId=item.object_id,
            position={"x": 0.0, "y": _FAR + number, "z": 0.0},
            rotation=asdict(item.rotation),
            forceAction=True,
            forceKinematic=True,
        )
    for item, where in moves:
        _place(simulator, item, where)
    after = simulator.view.objects
    moved = {item.object_id for item in lifted}
    for key, obj in before.items():
        if key not in moved and obj.parent_receptacles != after[key].parent_receptacles:
            raise EditRefused("the move changed what a third object is in or on")
        if key not in moved and obj.position != after[key].position:
            raise EditRefused("the move moved a third object")
    for item, where in moves:
        if after[item.object_id].parent_receptacles != before[where.object_id].parent_receptacles:
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


def size_ratio(one: ThorObject, other: ThorObject) -> float:
    """Return how many times as large one of two objects is in the direction of most difference."""
    if one.axis_aligned_bounding_box is None or other.axis_aligned_bounding_box is None:
        return math.inf
    sizes = [asdict(obj.axis_aligned_bounding_box.size) for obj in (one, other)]
    ratios = [(sizes[0][axis] + 0.01) / (sizes[1][axis] + 0.01) for axis in ("x", "y", "z")]
    return max(max(ratio, 1 / ratio) for ratio in ratios)


def _place(simulator: Simulator, item: ThorObject, where: ThorObject) -> None:
    """Stand an object where another one stood, or as near to it as there is room.

    Args:
        simulator: simulator with the restored scene.
        item: the object.
        where: the other one, before it was moved.
    """
    box = where.axis_aligned_bounding_box
    if box is None:
        raise EditRefused("the simulator does not report boxes")
    bottom = box.center.y - box.size.y / 2
    target = where.parent_receptacles or []
    for x, z in _OFFSETS:
        point = {"x": where.position.x + x, "y": bottom, "z": where.position.z + z}
        view = simulator.step("PlaceObjectAtPoint", objectId=item.object_id, position=point)
        if view.success and view.objects[item.object_id].parent_receptacles == target:
            return
    raise EditRefused("no room at the other's place")
