# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Questions about the scene (at a pixel, outlines, ways, poses), and which objects replies list."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.actions.targets import check_in_frame, object_at
from infthor_sim.agent import MAX_UP, Agent
from infthor_sim.errors import ActionError, DataError, ErrorCode
from infthor_sim.geometry import (
    Array,
    convex_hull,
    euler_matrix,
    level_gaps,
    round_vector,
    to_array,
    to_xyz,
)
from infthor_sim.objects import SimObject
from infthor_sim.physics.crowd import free_cells
from infthor_sim.pictures.cameras import map_camera
from infthor_sim.render.probe import VisibilityProbe
from infthor_sim.simulation import Simulation

_FINEST = 0.01  # metres; finer grids have millions of points
TILT = 30.0  # degrees between the horizons that are tried
_ALLOWED_ERROR = 1e-4  # metres; AI2-THOR's default
_NEAR = 0.2  # metres within which AI2-THOR looks for floor that one can stand on


class PoseAngles(NamedTuple):
    """Poses that are tried at a place: horizons and rotations in degrees, standing or not."""

    tilts: Sequence[float]
    turns: Sequence[float]
    standings: Sequence[bool]


@action("GetScenesInBuild", query=True)
def get_scenes_in_build(sim: Simulation) -> list[str]:
    """Return the names of scenes; ai2thor's Controller refuses others, or takes one of them."""
    try:
        return sim.catalogue.names()
    except DataError as error:
        raise ActionError(str(error), ErrorCode.INVALID_ARGUMENT) from error


@action("GetShortestPath", query=True)
def get_shortest_path(
    sim: Simulation,
    objectId: str | None = None,
    objectType: str | None = None,
    position: Vector3 | None = None,
    rotation: Vector3 | None = None,
    allowedError: float = _ALLOWED_ERROR,
) -> dict[str, Any]:
    """Return the places of a shortest way to where an object is interactable.

    The rotation at the start changes no way.
    """
    item = named_object(sim, objectId, objectType)
    start = sim.world.agent.position if position is None else to_array(position)
    return _corners(sim, way_to_object(sim, item, start, pose_angles(sim), allowedError))


@action("GetShortestPathToPoint", query=True, overloads=(("target",), ("x", "y", "z")))
def get_shortest_path_to_point(
    sim: Simulation,
    target: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    position: Vector3 | None = None,
    rotation: Vector3 | None = None,
    allowedError: float = _ALLOWED_ERROR,
) -> dict[str, Any]:
    """Return the places of a shortest way to the standing place nearest to a point."""
    start = sim.world.agent.position if position is None else to_array(position)
    goal = np.array([x, y, z], dtype=float) if target is None else to_array(target)
    return _corners(sim, path_to_point(sim, start, goal, allowedError))


def _corners(sim: Simulation, way: Sequence[tuple[float, float]]) -> dict[str, Any]:
    height = float(sim.world.agent.position[1])
    return {"corners": [{"x": x, "y": height, "z": z} for x, z in way]}


def named_object(sim: Simulation, object_id: str | None, object_type: str | None) -> SimObject:
    """Return the object with an id, or the only one of a type, as AI2-THOR's ways have it."""
    if object_id:
        return sim.world.get(object_id)
    named = [o for o in sim.world.objects.values() if o.object_type == object_type]
    if not named:
        raise ActionError(f"Object type {object_type} was not found in the scene.")
    if len(named) > 1:
        raise ActionError(
            f"Multiple objects of type {object_type} were found in the scene, "
            "cannot disambiguate: pass an objectId"
        )
    return named[0]


def _check_floor(sim: Simulation, allowed: float, **ends: Array) -> None:
    """Refuse ends (3,) of a way that are not above floor near to where the agent can stand."""
    low, high = sim.world.scene_bounds()
    gaps = {}
    for name, point in ends.items():
        text = "({:.3f}, {:.3f}, {:.3f})".format(*point)
        gaps[name] = sim.world.nav.gap(float(point[0]), float(point[2]))
        if gaps[name] > max(_NEAR, allowed):
            raise ActionError(f"No point on NavMesh near {name} {text}.")
        if not low[1] - _NEAR <= point[1] <= high[1]:
            raise ActionError(f"Raycast could not find the floor from position: {text}")
    if len(gaps) > 1 and min(gaps.values()) > allowed:
        far = " and ".join(f"{name} by {gap:.3f} m" for name, gap in gaps.items())
        raise ActionError(f"Closest point on NavMesh was too far from the agent: {far}.")


def path_to_point(
    sim: Simulation, start: Array, goal: Array, allowed: float = _ALLOWED_ERROR
) -> list[tuple[float, float]]:
    """Return the cells of a shortest way between those nearest to two points (3,)."""
    _check_floor(sim, allowed, startPosition=start, targetPosition=goal)
    nav = sim.world.nav
    path = nav.path(nav.nearest(start[0], start[2]), nav.nearest(goal[0], goal[2]))
    if path is None:
        raise ActionError("Could not find path to targetPosition using the NavMesh.")
    return path


def way_to_object(
    sim: Simulation,
    item: SimObject,
    start: Array,
    angles: PoseAngles,
    allowed: float = _ALLOWED_ERROR,
    yaw: float = 0.0,
) -> list[tuple[float, float]]:
    """Return the places of a shortest way, along axes at `yaw`, to where an object is seen."""
    _check_floor(sim, allowed, startPosition=start)
    nav = sim.world.nav
    begin = (float(start[0]), float(start[2]))
    if not nav.can_stand(*begin):
        begin = nav.nearest(*begin)
    poses = _poses_that_see(sim, item, sim.settings.visibility_distance, angles)
    height = float(sim.world.agent.position[1])
    for stop in nav.walk_out(begin, sim.settings.grid_size, yaw):
        if next(poses({"x": stop.place[0], "y": height, "z": stop.place[1]}), None):
            return stop.way()
    raise ActionError(
        f"Target object {item.object_id} is not visible on navigation path given current agent "
        f"parameters: maxVisibleDistance ({sim.settings.visibility_distance:g}), "
        f"gridSize ({sim.settings.grid_size:g}), fieldOfView ({sim.settings.field_of_view:g})"
    )


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


@action("GetReachablePositions", query=True)
def get_reachable_positions(
    sim: Simulation,
    maxStepCount: int = 10000,
    directionsRelativeAgent: bool = False,
    gridSize: float | None = None,
) -> list[dict[str, float]]:
    """Return positions that the agent can reach by steps of `gridSize`, along the axes or its
    own."""
    step = sim.settings.grid_size if gridSize is None else gridSize
    if step < _FINEST:
        raise ActionError(f"gridSize must be at least {_FINEST}, not {step}")
    agent = sim.world.agent
    yaw = agent.yaw if directionsRelativeAgent else 0.0
    cells = free_cells(sim.world)
    points = cells.reachable_points(agent.position[0], agent.position[2], step, yaw)
    if len(points) > maxStepCount / step**2:
        raise ActionError("Too many steps taken in GetReachablePositions.")
    return [{"x": x, "y": float(agent.position[1]), "z": z} for x, z in points]


@action("GetInteractablePoses", query=True)
def get_interactable_poses(
    sim: Simulation,
    objectId: str,
    positions: list[Vector3] | None = None,
    rotations: list[float] | None = None,
    horizons: list[float] | None = None,
    standings: list[bool] | None = None,
    maxDistance: float | None = None,
    maxPoses: int = 2**31 - 1,
) -> list[dict[str, Any]]:
    """Return poses for TeleportFull from which the agent sees an object within its reach."""
    if maxPoses <= 0:
        raise ActionError("maxPoses must be greater than 0")
    item = sim.world.get(objectId)
    reach = sim.settings.visibility_distance if maxDistance is None else maxDistance
    usual = pose_angles(sim)
    angles = PoseAngles(
        usual.tilts if horizons is None else horizons,
        usual.turns if rotations is None else rotations,
        usual.standings if standings is None else standings,
    )
    places = get_reachable_positions(sim) if positions is None else positions
    poses = _poses_that_see(sim, item, reach, angles)
    return list(islice((pose for place in places for pose in poses(place)), maxPoses))


def pose_angles(sim: Simulation) -> PoseAngles:
    """Return the directions and heights that AI2-THOR tries."""
    turns = _range(0.0, 360.0 - 1e-6, sim.settings.rotate_step)
    return PoseAngles(_range(-MAX_UP, sim.world.agent.max_down, TILT), turns, [True, False])


def _poses_that_see(
    sim: Simulation, item: SimObject, reach: float, angles: PoseAngles
) -> Callable[[Mapping[str, float]], Iterator[dict[str, Any]]]:
    """Return a function of a place: it yields the poses there that see an object within reach."""
    tilts, turns, heights = angles
    if sim.world.is_hidden(item) or not (tilts and turns and heights):
        return lambda _: iter(())
    probe = sim.vision.probe(item)
    bounds = item.bounds()
    matrices = np.array(
        [euler_matrix((tilt, turn % 360.0, 0.0)) for tilt, turn in product(tilts, turns)]
    ).reshape(len(tilts), len(turns), 3, 3)

    def poses(place: Mapping[str, float]) -> Iterator[dict[str, Any]]:
        if level_gaps(to_array(place)[[0, 2]], *bounds) > reach:
            return
        agent = replace(sim.world.agent, position=to_array(place))
        seen = [_seen(sim, replace(agent, standing=h), turns, matrices, probe) for h in heights]
        for (i, tilt), (j, turn), (k, standing) in product(*map(enumerate, angles)):
            if seen[k][i, j]:
                yield {**place, "rotation": turn, "standing": standing, "horizon": tilt}

    return poses


def _seen(
    sim: Simulation, agent: Agent, turns: Sequence[float], matrices: Array, probe: VisibilityProbe
) -> NDArray[np.bool_]:
    """Return in which directions (tilts, turns) of (tilts, turns, 3, 3) the object is seen."""
    if agent.eye[0] == agent.eye[2] == 0:  # turning does not move the camera
        seen = sim.vision.sees_from(agent, matrices.reshape(-1, 3, 3), probe)
        return seen.reshape(matrices.shape[:2])
    columns = [
        sim.vision.sees_from(replace(agent, yaw=turn % 360.0), matrices[:, index], probe)
        for index, turn in enumerate(turns)
    ]
    return np.stack(columns, axis=1)


def _range(first: float, last: float, step: float) -> list[float]:
    return [first + index * step for index in range(int((last - first) / step) + 1)]
