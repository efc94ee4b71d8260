"""Several agents in one scene: adding and removing them, and how they are in each other's way."""

import math
from dataclasses import replace

import numpy as np

from infthor_sim.agent import AGENT_RADIUS, HAND_AT_REST, Agent
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array
from infthor_sim.physics.falling import let_fall
from infthor_sim.physics.navigation import NavGrid
from infthor_sim.world import World

MOST_AGENTS = 6  # AI2-THOR has colours for so many
_BETWEEN = 2 * AGENT_RADIUS  # metres between the middles of two agents that touch
_SAME = 1e-6  # metres
_SHARES = tuple(np.linspace(0.0, 1.0, 21))  # of a step, at which the agents' distance is checked
_NEAREST = 4  # AI2-THOR leaves so many of the places next to the first agent free


def set_agent_count(world: World, count: int, step: float) -> None:
    """Keep the first agent alone, and add others as AI2-THOR does: near it, looking as it does.

    Args:
        world: the scene; what the agents hold that are taken out of it falls.
        count: number of agents.
        step: metres; places are twice as far apart.
    """
    world.active = 0
    for agent in world.agents[1:]:
        if agent.held is not None:
            item = world.objects[agent.held]
            world.let_go(item)
            let_fall(world, item, item.center)
    first = world.agent
    del world.agents[1:]
    x, _, z = first.position
    places = world.nav.reachable_points(x, z, 2 * step, 0.0) if count > 1 else []
    places.sort(key=lambda place: (round(math.dist(place, (x, z)), 3), place))
    for place in places[_NEAREST + 1 :]:
        target = np.array([place[0], first.position[1], place[1]])
        is_free = all(_distance(a, target) >= _BETWEEN for a in world.agents)
        if len(world.agents) < count and is_free:
            world.agents.append(
                replace(first, position=target, held=None, grip=None, hand=HAND_AT_REST)
            )
    room = len(world.agents)
    if room < count:
        del world.agents[1:]
        raise ActionError(f"there is room for {room} agents, not for {count}")
    world.mark_changed()


def agent_at(world: World, point: Array) -> str | None:
    """Return what messages call an agent that the active one would touch at a point, or None."""
    return next((f"Agent {i}" for i, a in world.others() if _distance(a, point) < _BETWEEN), None)


def agent_on_way(world: World, end: Array) -> str | None:
    """Return what messages call an agent between the active one and a point, or None.

    One that it touches already only keeps it from coming nearer.
    """
    start = world.agent.position
    for number, other in world.others():
        allowed = min(_BETWEEN, _distance(other, start)) - _SAME
        if any(_distance(other, start + (end - start) * s) < allowed for s in _SHARES):
            return f"Agent {number}"
    return None


def free_cells(world: World) -> NavGrid:
    """Return the cells where the active agent can stand without touching another one."""
    if len(world.agents) == 1:
        return world.nav
    height = world.standing_height
    is_free = world.nav.is_free

    def is_apart(x: float, z: float) -> bool:
        return agent_at(world, np.array([x, height, z])) is None

    return NavGrid(
        (cell for cell in world.nav if is_apart(*cell)),
        is_free and (lambda x, z: is_free(x, z) and is_apart(x, z)),
    )


def _distance(agent: Agent, point: Array) -> float:
    """Return metres between an agent and a point (3,), on the level."""
    return math.hypot(*(agent.position - point)[[0, 2]])
