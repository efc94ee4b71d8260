"""Doors between rooms: the floor that their leaves take, and the agents that they would hit."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.agent import AGENT_RADIUS
from infthor_sim.geometry import Array, segment_gaps
from infthor_sim.objects import SimObject
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.physics.obstacles import leaves
from infthor_sim.world import World

BODY = 0.22  # the agent's radius and a margin, metres
_SWEEP = 6  # positions of a leaf on its way that are checked


def update_floor(world: World) -> None:
    """Let the agent stand on those cells of the floor that no leaf of a door takes."""
    if world.floor is None:
        return
    points = np.array(list(world.floor)).reshape(-1, 2)
    free = np.ones(len(points), dtype=bool)
    for door in world.objects.values():
        if door.type.in_doorway and door.type.hinged:
            free &= ~_touched(points, door, door.state.openness, BODY)
    world.nav = NavGrid([(float(x), float(z)) for x, z in points[free]])


def hits_agent(world: World, door: SimObject, openness: float) -> bool:
    """Return whether a leaf of a door would hit an agent on its way to `openness`."""
    at = np.array([agent.position[[0, 2]] for agent in world.agents])
    way = np.linspace(door.state.openness, openness, _SWEEP)[1:]
    return any(_touched(at, door, share, AGENT_RADIUS).any() for share in way)


def _touched(points: Array, door: SimObject, openness: float, reach: float) -> NDArray[np.bool_]:
    """Return which points (n, 2) are nearer to a leaf than `reach` metres."""
    gaps = [segment_gaps(points, *ends) for ends in leaves(door, openness)]
    return np.asarray(np.min(gaps, axis=0) < reach)
