"""The next action of an expert that knows the scene, on the way to an object or a point."""

import math
from collections.abc import Sequence

import numpy as np

from infthor_sim.actions.queries import (
    TILT,
    named_object,
    path_to_point,
    pose_angles,
    way_to_object,
)
from infthor_sim.actions.registry import Vector3, action
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, euler_matrix, to_array
from infthor_sim.objects import SimObject
from infthor_sim.physics.crowd import agent_on_way
from infthor_sim.physics.navigation import CELL
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

    The object is that of `objectId` or the only one of `objectType`.
    """
    agent = sim.world.agent
    if position is not None:
        return _next_step(sim, _way_to_point(sim, to_array(position)))
    item = named_object(sim, objectId, objectType)
    if item.object_id in sim.vision.visible_ids():
        return None
    step = sim.settings.rotate_step
    turns = [agent.yaw + number * step for number in _turns(sim)]
    angles = pose_angles(sim)._replace(turns=turns, standings=[agent.standing])
    way = way_to_object(sim, item, agent.position, angles, yaw=agent.yaw % step)
    return _next_step(sim, way) or _next_look(sim, item, angles.tilts)


def _turns(sim: Simulation) -> list[int]:
    """Return the turns by the agent's step, fewest first: 0, 1 to the right, 1 to the left, ..."""
    count = 360.0 / sim.settings.rotate_step
    if abs(count - round(count)) > 1e-5:
        raise ActionError("Invalid rotate step degrees for agent, must be a divisor of 360")
    return sorted((i if i <= count / 2 else i - round(count) for i in range(round(count))), key=abs)


def _way_to_point(sim: Simulation, goal: Array) -> list[tuple[float, float]]:
    """Return the places of a way to a point (3,), by the agent's steps if they lead near to it."""
    agent, size, turn = sim.world.agent, sim.settings.grid_size, sim.settings.rotate_step
    path = path_to_point(sim, agent.position, goal)
    if size == CELL and turn <= 90:  # such steps keep near to the cells; quicker
        return path
    here = (agent.position[0], agent.position[2])
    stops = sim.world.nav.walk_out(here, size, agent.yaw % turn)
    end = min(stops, key=lambda stop: math.dist(stop.place, (goal[0], goal[2])))
    return end.way() if math.dist(end.place, (goal[0], goal[2])) <= size else path


def _next_step(sim: Simulation, way: Sequence[tuple[float, float]]) -> str | None:
    """Return the step or turn along a way, to as far a place of it as it can; None at its end."""
    world, size = sim.world, sim.settings.grid_size
    here = (float(world.agent.position[0]), float(world.agent.position[2]))
    moves = []
    for turns in _turns(sim):
        angle = math.radians(world.agent.yaw + turns * sim.settings.rotate_step)
        end = (here[0] + math.sin(angle) * size, here[1] + math.cos(angle) * size)
        level = np.array([end[0], world.agent.position[1], end[1]])
        if world.nav.can_walk(here, end) and agent_on_way(world, level) is None:
            moves.append((turns, end))
    for place in reversed(way[1:]):
        if place != way[1] and not world.nav.can_walk(here, place):
            continue
        left = [(round(math.dist(end, place), 4), abs(turns), turns) for turns, end in moves]
        best = min(left, default=(math.inf, 0, 0))
        if best[0] < math.dist(here, place) - _SAME:
            return "MoveAhead" if best[2] == 0 else _turn_name(best[2])
    if len(way) > 1:
        raise ActionError(
            f"Can't seem to move nearer to the target: {len(way) - 1} steps of {size:g} m are left"
        )
    return None


def _next_look(sim: Simulation, item: SimObject, tilts: Sequence[float]) -> str:
    """Return the turn or tilt of the fewest that show an object from here."""
    agent = sim.world.agent
    poses = [
        (abs(turns) + abs(tilt - agent.horizon) / TILT, turns, tilt)
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
