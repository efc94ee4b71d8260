# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Questions about the scene: where the agent can stand, what it would see, the way to an object."""

from typing import Any

from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.actions.targets import object_at
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import to_array, to_xyz
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


@action("GetScenesInBuild", query=True)
def get_scenes_in_build(sim: Simulation) -> list[str]:
    """Names that Reset takes; empty, which tells the client not to check, as procedural names are unlimited."""
    return []


@action("GetReachablePositions", query=True)
def get_reachable_positions(
    sim: Simulation, gridSize: float | None = None, maxStepCount: int = 10000
) -> list[dict[str, float]]:
    """Positions that the agent can reach by steps on the grid."""
    agent = sim.world.agent
    cells = sim.world.nav.reachable(agent.position[0], agent.position[2])
    return [{"x": x, "y": float(agent.position[1]), "z": z} for x, z in cells]


@action("GetShortestPath", "GetShortestPathToPoint", query=True)
def get_shortest_path(
    sim: Simulation,
    objectId: str | None = None,
    objectType: str | None = None,
    position: Vector3 | None = None,
    target: Vector3 | None = None,
    allowedError: float = 0.05,
) -> dict[str, Any]:
    """Corners of a shortest way over the grid to the standing place nearest to an object or point."""
    world = sim.world
    goal = _goal(sim, objectId, objectType, target)
    start = world.agent.position if position is None else to_array(position)
    path = world.nav.path((start[0], start[2]), world.nav.nearest(goal[0], goal[2]))
    if path is None:
        raise ActionError("Path to target could not be found")
    height = float(world.agent.position[1])
    return {"corners": [{"x": x, "y": height, "z": z} for x, z in path]}


def _goal(sim: Simulation, object_id: str | None, object_type: str | None, target: Vector3 | None) -> Any:
    if target is not None:
        return to_array(target)
    if object_id is not None:
        return sim.world.get(object_id).center
    named = [o for o in sim.world.objects.values() if o.object_type == object_type]
    if not named:
        raise ActionError(f"No object of type {object_type!r} is in the scene")
    return min(named, key=lambda o: (sim.world.distance(o), o.object_id)).center


@action("GetObjectInFrame", query=True)
def get_object_in_frame(sim: Simulation, x: float, y: float, checkVisible: bool = False) -> str | None:
    """Id of the object at (x, y), shares of the frame from its top left; None for none."""
    found = object_at(sim, x, y)
    return None if checkVisible and found not in sim.visible() else found


@action("GetMapViewCameraProperties", query=True)
def get_map_view_camera_properties(sim: Simulation) -> dict[str, Any]:
    """Arguments of AddThirdPartyCamera for a view of the whole scene from above."""
    camera = sim.map_camera()
    return {
        "position": to_xyz(camera.position),
        "rotation": to_xyz(camera.rotation),
        "orthographic": True,
        "orthographicSize": camera.orthographic_size,
    }
