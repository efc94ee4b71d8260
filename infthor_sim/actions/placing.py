# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Putting objects anywhere, disabling and enabling them, and points of receptacles' surfaces."""

import numpy as np

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, to_array, to_xyz, yaw_matrix
from infthor_sim.objects import SimObject
from infthor_sim.physics.clearance import occupant
from infthor_sim.physics.falling import assign_parent, let_fall
from infthor_sim.physics.receptacles import Surface, surfaces
from infthor_sim.rearrange import assign_parents
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

_SPACING = 0.05  # metres between the points of a surface


@action("TeleportObject", overloads=(("position",), ("x", "y", "z"), ("positions",)))
def teleport_object(
    sim: Simulation,
    objectId: str,
    rotation: Vector3,
    position: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    positions: list[Vector3] | None = None,
    forceAction: bool = False,
    forceKinematic: bool = False,
    allowTeleportOutOfHand: bool = False,
    makeUnbreakable: bool = False,
) -> None:
    """Give an object a pose, the first of several positions at which there is room; then it falls.

    With `forceAction` it goes where there is no room too, with `forceKinematic` it stays in the
    air.
    """
    world = sim.world
    item = sim.world.get(objectId)
    if item.object_id in world.held_ids() and not allowTeleportOutOfHand:
        raise ActionError("Cannot teleport object in hand.")
    if position is None:
        position = Vector3(
            (axis, value) for axis, value in (("x", x), ("y", y), ("z", z)) if value is not None
        )
    pose = _first_free(world, item, positions or [position], to_array(rotation), forceAction)
    _set_pose(world, item, pose)
    if not forceKinematic and item.type.pickupable:
        let_fall(world, item, item.center)


@action("PlaceObjectAtPoint")
def place_object_at_point(
    sim: Simulation,
    objectId: str,
    position: Vector3,
    rotation: Vector3 | None = None,
    forceKinematic: bool = False,
) -> None:
    """Stand an object on a point, in its own rotation or the given one, if there is room."""
    world = sim.world
    item = sim.world.get(objectId)
    if not (item.type.pickupable or item.type.moveable):
        raise ActionError(f"{objectId} is neither pickupable nor moveable")
    pose = _copy(item)
    pose.rotation = item.rotation if rotation is None else to_array(rotation)
    pose.place_bottom(to_array(position))
    obstacle = occupant(world, pose)
    if obstacle is not None:
        raise ActionError(
            f"spawn area not clear ({obstacle} is in the way), can't place object at that point"
        )
    _set_pose(world, item, pose)


@action("GetSpawnCoordinatesAboveReceptacle", query=True)
def get_spawn_coordinates(
    sim: Simulation, objectId: str, anywhere: bool = True
) -> list[dict[str, float]]:
    """Return points on a receptacle's surfaces: all, or those seen within the agent's reach."""
    receptacle = sim.world.get(objectId)
    if not receptacle.type.receptacle:
        raise ActionError(f"{objectId} is not a receptacle")
    points = np.concatenate([_surface_points(surface) for surface in surfaces(receptacle)])
    if not anywhere:
        away = np.linalg.norm((points - sim.world.agent.position)[:, [0, 2]], axis=1)
        points = points[sim.vision.in_frame(points) & (away <= sim.settings.visibility_distance)]
    return [to_xyz(np.round(point, 6)) for point in points]


@action("DisableObject")
def disable_object(sim: Simulation, objectId: str) -> None:
    """Take an object out of the scene until it is enabled again; its contents stay."""
    item = sim.world.get(objectId)
    sim.world.let_go(item)
    sim.world.remove(item)
    item.contents = []
    sim.world.disabled[objectId] = item


@action("EnableObject")
def enable_object(sim: Simulation, objectId: str) -> None:
    """Bring a disabled object back to where it was."""
    item = sim.world.disabled.pop(objectId, None)
    if item is None:
        if objectId not in sim.world.objects:
            raise ActionError(f"No object with ID {objectId} is disabled")
        return
    sim.world.add(item)
    assign_parents(sim.world)


def _first_free(
    world: World, item: SimObject, positions: list[Vector3], turn: Array, force: bool
) -> SimObject:
    """Return a copy of an object at the first of some positions with room; if forced, at the
    first."""
    obstacle: str | None = None
    for position in positions:
        pose = _copy(item)
        pose.position = to_array(position)
        pose.rotation = turn
        obstacle = None if force else occupant(world, pose)
        if obstacle is None:
            return pose
    raise ActionError(
        f"{obstacle} is in the way of {item.object_id}; pass forceAction to put it there "
        "nevertheless"
    )


def _copy(item: SimObject) -> SimObject:
    """Return a copy of an object that can be given another pose to try."""
    pose = item.duplicate(item.object_id)
    pose.contents = list(item.contents)  # which are then not in the way of the copy
    return pose


def _set_pose(world: World, item: SimObject, pose: SimObject) -> None:
    world.let_go(item)
    world.set_pose(item, pose.position, pose.rotation)
    if item.type.pickupable:
        assign_parent(world, item)
    world.mark_changed()


def _surface_points(surface: Surface) -> Array:
    """Return a grid of points (n, 3) on a surface."""
    spans = [np.arange(-half + _SPACING / 2, half, _SPACING) for half in surface.half]
    across, along = np.meshgrid(*spans, indexing="ij")
    flat = np.stack([across.ravel(), np.zeros(across.size), along.ravel()], axis=1)
    points: Array = flat @ yaw_matrix(surface.yaw).T + surface.center
    return points
