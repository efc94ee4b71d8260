# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Putting objects anywhere, taking them out of the scene for a time, and the points at which they would stand."""

import numpy as np

from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.clearance import occupant
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.falling import let_fall, settle_in
from infthor_eval.sim.geometry import Array, to_array, to_xyz, yaw_matrix
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.receptacles import Surface, surfaces
from infthor_eval.sim.restore import settle_parents
from infthor_eval.sim.simulation import Simulation
from infthor_eval.sim.world import World

__all__: list[str] = []

_SPACING = 0.05  # metres between the points of a surface


@action("TeleportObject", forms=(("position",), ("x", "y", "z"), ("positions",)))
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

    With `forceAction` it goes where there is no room too, with `forceKinematic` it stays in the air.
    """
    world, item = sim.world, sim.world.get(objectId)
    if item.object_id in world.carried() and not allowTeleportOutOfHand:
        raise ActionError("Cannot teleport object in hand.")
    tried = positions or [_given(position, x, y, z)]
    pose = _first_free(world, item, tried, to_array(rotation), forceAction)
    _put(world, item, pose)
    if not forceKinematic and item.type.pickupable:
        let_fall(world, item, item.center)


@action("PlaceObjectAtPoint")
def place_object_at_point(
    sim: Simulation, objectId: str, position: Vector3, rotation: Vector3 | None = None, forceKinematic: bool = False
) -> None:
    """Stand an object on a point, as it is turned or upright and turned as told, if there is room."""
    world, item = sim.world, sim.world.get(objectId)
    if not (item.type.pickupable or item.type.moveable):
        raise ActionError(f"{objectId} is neither pickupable nor moveable")
    pose = _copy(item)
    pose.rotation = item.rotation if rotation is None else to_array(rotation)
    pose.place_bottom(to_array(position))
    obstacle = occupant(world, pose)
    if obstacle is not None:
        raise ActionError(f"spawn area not clear ({obstacle} is in the way), can't place object at that point")
    _put(world, item, pose)


@action("GetSpawnCoordinatesAboveReceptacle", query=True)
def get_spawn_coordinates(sim: Simulation, objectId: str, anywhere: bool = True) -> list[dict[str, float]]:
    """Points on a receptacle's surfaces, all of them or those that the agent sees within its reach."""
    receptacle = sim.world.get(objectId)
    if not receptacle.type.receptacle:
        raise ActionError(f"{objectId} is not a receptacle")
    points = np.concatenate([_points(surface) for surface in surfaces(receptacle)])
    if not anywhere:
        away = np.linalg.norm((points - sim.world.agent.position)[:, [0, 2]], axis=1)
        points = points[sim.in_view(points) & (away <= sim.settings.visibility_distance)]
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
    settle_parents(sim.world)


def _given(position: Vector3 | None, x: float | None, y: float | None, z: float | None) -> Vector3:
    if position is not None:
        return position
    return Vector3((axis, value) for axis, value in (("x", x), ("y", y), ("z", z)) if value is not None)


def _first_free(world: World, item: SimObject, tried: list[Vector3], turn: Array, force: bool) -> SimObject:
    """The pose at the first of some positions with room; at the very first if forced.

    Raises:
        ActionError: there is room at none.
    """
    obstacle: str | None = None
    for position in tried:
        pose = _copy(item)
        pose.position, pose.rotation = to_array(position), turn
        obstacle = None if force else occupant(world, pose)
        if obstacle is None:
            return pose
    raise ActionError(f"{obstacle} is in the way of {item.object_id}; pass forceAction to put it there nevertheless")


def _copy(item: SimObject) -> SimObject:
    """A copy with the same contents, to be given another pose."""
    pose = item.duplicate(item.object_id)
    pose.contents = list(item.contents)
    return pose


def _put(world: World, item: SimObject, pose: SimObject) -> None:
    world.let_go(item)
    world.set_pose(item, pose.position, pose.rotation)
    if item.type.pickupable:
        settle_in(world, item)
    world.touch()


def _points(surface: Surface) -> Array:
    """A lattice of points (n, 3) on a surface."""
    spans = [np.arange(-half + _SPACING / 2, half, _SPACING) for half in surface.half]
    across, along = (axis.ravel() for axis in np.meshgrid(*spans, indexing="ij"))
    flat = np.stack([across, np.zeros(len(across)), along], axis=1)
    points: Array = flat @ yaw_matrix(surface.yaw).T + surface.center
    return points
