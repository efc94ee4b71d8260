"""The primitives of an agent's body, as other agents and cameras see it."""

import numpy as np

from infthor_sim.agent import AGENT_HEIGHT, AGENT_RADIUS, Agent
from infthor_sim.geometry import Array, euler_matrix
from infthor_sim.render.primitives import Color, Form, Material, ShapePart, rows
from infthor_sim.world import World

BODY = "Agent"  # its name in segmentation frames
# by id of the agent, as in AI2-THOR: blue, yellow, green, red, magenta, grey
_COLORS: tuple[Color, ...] = (
    (0.15, 0.3, 0.85), (0.9, 0.8, 0.15), (0.2, 0.65, 0.25), (0.8, 0.2, 0.15), (0.75, 0.2, 0.7),
    (0.5, 0.5, 0.5),
)  # fmt: skip
_BASE: Color = (0.18, 0.19, 0.21)
_HEAD: Color = (0.88, 0.88, 0.86)
_LENS: Color = (0.05, 0.05, 0.07)
_HEAD_HALF = (0.11, 0.07, 0.08)  # metres


def body_rows(agent: Agent, number: int, instance: int) -> Array:
    """Return the primitives (n, COLUMNS) of an agent: base, coloured trunk, head that tilts.

    Args:
        agent: the agent.
        number: its id, which chooses its colour.
        instance: index of the bodies in the picture's table of instances.
    """
    eye = float(agent.camera_position()[1] - agent.position[1])
    trunk = (eye - _HEAD_HALF[1] + AGENT_HEIGHT) / 2
    radius = 0.8 * AGENT_RADIUS
    tilt = euler_matrix((agent.horizon, 0.0, 0.0))
    head = np.array([0.0, eye, 0.0])
    parts = [
        ShapePart(
            Form.CYLINDER,
            (0.0, trunk - AGENT_HEIGHT, 0.0),
            (radius, trunk, radius),
            _COLORS[number],
            Material.PLAIN,
            top=0.6,
        ),
        ShapePart(
            Form.CYLINDER,
            (0.0, 0.08 - AGENT_HEIGHT, 0.0),
            (AGENT_RADIUS, 0.08, AGENT_RADIUS),
            _BASE,
        ),
        ShapePart(Form.BOX, head, _HEAD_HALF, _HEAD, Material.PLAIN, tilt),
    ]
    for side in (-0.05, 0.05):
        at = head + tilt @ np.array([side, 0.0, _HEAD_HALF[2]])
        parts.append(ShapePart(Form.ELLIPSOID, at, (0.022, 0.022, 0.022), _LENS))
    return rows(parts, agent.position, euler_matrix((0.0, agent.yaw, 0.0)), instance)


def bodies_state(world: World) -> tuple[object, ...]:
    """Return what the bodies that the active agent may see depend on; caches compare it."""
    # Agents walk without a new version of the world.
    return tuple((*a.position, a.yaw, a.horizon, a.standing, a.drawn) for _, a in world.others())
