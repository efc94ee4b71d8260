# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Questions about the scene (at a pixel, outlines, ways), and which objects replies list."""

from typing import Any

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.actions.targets import check_in_frame, object_at
from infthor_sim.errors import ActionError, DataError, ErrorCode
from infthor_sim.geometry import convex_hull, round_vector, to_array, to_xyz
from infthor_sim.objects import SimObject
from infthor_sim.pictures.cameras import map_camera
from infthor_sim.simulation import Simulation


@action("GetScenesInBuild", query=True)
def get_scenes_in_build(sim: Simulation) -> list[str]:
    """Return the names of scenes; ai2thor's Controller refuses others, or takes one of them."""
    try:
        return sim.catalogue.names()
    except DataError as error:
        raise ActionError(str(error), ErrorCode.INVALID_ARGUMENT) from error


@action("GetShortestPath", "GetShortestPathToPoint", query=True)
def get_shortest_path(
    sim: Simulation,
    objectId: str | None = None,
    objectType: str | None = None,
    position: Vector3 | None = None,
    target: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    rotation: Vector3 | None = None,
    allowedError: float = 0.05,
) -> dict[str, Any]:
    """Return the corners of a shortest way to the standing place nearest to an object or point.

    The point is `target`, or `x`, `y`, `z`. The rotation at the start changes no way.
    """
    world = sim.world
    if x is not None and y is not None and z is not None:
        target = Vector3(x=x, y=y, z=z)
    goal = _goal(sim, objectId, objectType, target)
    start = world.agent.position if position is None else to_array(position)
    path = world.nav.path((start[0], start[2]), world.nav.nearest(goal[0], goal[2]))
    if path is None:
        raise ActionError("Path to target could not be found")
    height = float(world.agent.position[1])
    return {"corners": [{"x": x, "y": height, "z": z} for x, z in path]}


def _goal(
    sim: Simulation, object_id: str | None, object_type: str | None, target: Vector3 | None
) -> Any:
    if target is not None:
        return to_array(target)
    if object_id is not None:
        return sim.world.get(object_id).center
    return nearest_of_type(sim, object_type).center


def nearest_of_type(sim: Simulation, object_type: str | None) -> SimObject:
    """Return the object of a type that is nearest to the agent."""
    candidates = [o for o in sim.world.objects.values() if o.object_type == object_type]
    if not candidates:
        raise ActionError(f"No object of type {object_type!r} is in the scene")
    return min(candidates, key=lambda o: (sim.world.distance(o), o.object_id))


@action("GetObjectInFrame", query=True)
def get_object_in_frame(sim: Simulation, x: float, y: float, checkVisible: bool = False) -> str:
    """Return the id of the object at (x, y), shares of the frame from its top left."""
    object_id = object_at(sim, x, y)
    if object_id is None:
        raise ActionError(f"no sim objects found at ({x},{y})")
    if checkVisible and object_id not in sim.vision.visible_ids():
        raise ActionError(
            f"target hit ({object_id}) at ({x}, {y}) is not currently Visible to Agent"
        )
    return object_id


@action("GetCoordinateFromRaycast", query=True)
def get_coordinate_from_raycast(sim: Simulation, x: float, y: float) -> dict[str, float]:
    """Return the world position seen at (x, y), shares of the frame from its top left."""
    check_in_frame(x, y)
    point = sim.vision.point_at(x, 1.0 - y)
    if point is None:
        raise ActionError(f"Nothing is at (x: {x}, y: {y})")
    return to_xyz(point)


@action("Get2DSemanticHull", query=True)
def get_semantic_hull(sim: Simulation, objectId: str) -> list[list[float]]:
    """Return the corners (x, z) of the outline of an object seen from above."""
    return _hull(sim.world.get(objectId))


@action("Get2DSemanticHulls", query=True)
def get_semantic_hulls(
    sim: Simulation, objectIds: list[str] | None = None, objectTypes: list[str] | None = None
) -> dict[str, list[list[float]]]:
    """Return outlines from above of all objects, of those of some types, or of some ids."""
    if objectIds is not None and objectTypes is not None:
        raise ActionError("Only one of objectTypes and objectIds can have a non-null value.")
    if objectIds is not None:
        return {object_id: _hull(sim.world.get(object_id)) for object_id in objectIds}
    objects = sim.world.objects.values()
    return {
        o.object_id: _hull(o)
        for o in objects
        if objectTypes is None or o.object_type in objectTypes
    }


def _hull(item: SimObject) -> list[list[float]]:
    return [round_vector(point, 6) for point in convex_hull(item.oriented_corners()[:, [0, 2]])]


@action("TestFastEmit", query=True)
def fast_emit(sim: Simulation, rvalue: str) -> str:
    """Return the argument without a new state; AI2-THOR tests its transport with it."""
    return rvalue


@action("TestActionReflectParam")
def reflect(sim: Simulation, rvalue: str) -> str:
    """Return the argument with a new state; AI2-THOR tests its transport with it."""
    return rvalue


@action("GetMapViewCameraProperties", query=True)
def get_map_view_camera_properties(sim: Simulation) -> dict[str, Any]:
    """Return arguments of AddThirdPartyCamera for a view of the whole scene from above."""
    camera = map_camera(sim.world)
    return {
        "position": to_xyz(camera.position),
        "rotation": to_xyz(camera.rotation),
        "orthographic": True,
        "orthographicSize": camera.orthographic_size,
    }


@action("SetObjectFilter")
def set_object_filter(sim: Simulation, objectIds: list[str]) -> None:
    """Leave all objects but these out of the metadata; the world stays as it is."""
    sim.object_filter = frozenset(objectIds)


@action("ResetObjectFilter")
def reset_object_filter(sim: Simulation) -> None:
    """List all objects again."""
    sim.object_filter = None
