"""The next action of an expert that knows the scene, on the way to an object or a point."""

import math

import numpy as np

from infthor_sim.actions.queries import TILT, nearest_of_type
from infthor_sim.actions.registry import Vector3, action
from infthor_sim.agent import MAX_UP
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, euler_matrix, to_array
from infthor_sim.objects import SimObject
from infthor_sim.physics.crowd import agent_on_way
from infthor_sim.simulation import Simulation

_SAME = 1e-6  # metres


@action("ObjectNavExpertAction", query=True)
def expert_action(
    sim: Simulation,
    objectType: str | None = None,
    objectId: str | None = None,
    position: Vector3 | None = None,
) -> str | None:
    """Return the name of the next action to see an object or be at a point; None where it is done.

    The object is that of `objectId` or the nearest of `objectType`.
    """
    _turns(sim)
    if position is not None:
        return _next_step(sim, to_array(position))
    item = nearest_of_type(sim, objectType) if objectId is None else sim.world.get(objectId)
    if item.object_id in sim.vision.visible_ids():
        return None
    return _next_step(sim, item.center) or _next_look(sim, item)


def _turns(sim: Simulation) -> list[int]:
    """Return the turns by the agent's step, fewest first: 0, 1 to the right, 1 to the left, ..."""
    count = 360.0 / sim.settings.rotate_step
    if abs(count - round(count)) > 1e-5:
        raise ActionError("Invalid rotate step degrees for agent, must be a divisor of 360")
    return sorted((i if i <= count / 2 else i - round(count) for i in range(round(count))), key=abs)


def _next_step(sim: Simulation, goal: Array) -> str | None:
    """Return the step or turn towards the standing place nearest to a point (3,); None there."""
    world = sim.world
    here = world.agent.position
    way = world.nav.path((here[0], here[2]), world.nav.nearest(goal[0], goal[2]))
    if way is None:
        raise ActionError("Path to target could not be found")
    if len(way) == 1:
        return None
    corner = next(
        cell
        for cell in reversed(way)
        if cell == way[1] or world.nav.can_walk((here[0], here[2]), cell)
    )
    best = (math.dist((here[0], here[2]), corner) - _SAME, 0)
    chosen: int | None = None
    for turns in _turns(sim):
        angle = math.radians(world.agent.yaw + turns * sim.settings.rotate_step)
        end = here + np.array([math.sin(angle), 0.0, math.cos(angle)]) * sim.settings.grid_size
        rank = (round(math.dist((end[0], end[2]), corner), 4), abs(turns))
        free = world.nav.can_walk((here[0], here[2]), (end[0], end[2]))
        if free and rank < best and agent_on_way(world, end) is None:
            best, chosen = rank, turns
    if chosen is None:
        return None
    return "MoveAhead" if chosen == 0 else _turn_name(chosen)


def _next_look(sim: Simulation, item: SimObject) -> str:
    """Return the turn or tilt of the fewest that show an object from here."""
    agent = sim.world.agent
    tilts = np.arange(-MAX_UP, agent.max_down + 1.0, TILT)
    poses = [
        (abs(turns) + abs(float(tilt) - agent.horizon) / TILT, turns, float(tilt))
        for turns in _turns(sim)
        for tilt in tilts
    ]
    step = sim.settings.rotate_step
    matrices = np.array(
        [euler_matrix((tilt, agent.yaw + turns * step, 0.0)) for _, turns, tilt in poses]
    )
    seen = sim.vision.sees_from(agent, matrices, sim.vision.probe(item))
    if not seen.any():
        raise ActionError(f"{item.object_id} is not visible from the end of the way to it")
    _, turns, tilt = min(pose for pose, sees in zip(poses, seen, strict=True) if sees)
    if turns:
        return _turn_name(turns)
    return "LookDown" if tilt > agent.horizon else "LookUp"


def _turn_name(turns: int) -> str:
    return "RotateRight" if turns > 0 else "RotateLeft"
