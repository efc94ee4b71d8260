"""Putting the agent elsewhere."""

import numpy as np

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.agent import MAX_UP
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array
from infthor_sim.physics.crowd import agent_at
from infthor_sim.physics.obstacles import blocking_object, nearest_name
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

_STEP_HEIGHT = 0.05  # metres that a teleport's y may be off the floor


@action("Teleport", overloads=((), ("x", "y", "z")))
def teleport(
    sim: Simulation,
    position: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    rotation: Vector3 | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
) -> None:
    """Put the agent elsewhere; what is not given stays as it is."""
    agent = sim.world.agent
    components = position or {
        axis: value for axis, value in (("x", x), ("y", y), ("z", z)) if value is not None
    }
    target = np.array(
        [float(components.get(axis, now)) for axis, now in zip("xyz", agent.position, strict=True)]
    )
    turn = agent.yaw if rotation is None else float(rotation.get("y", 0.0))
    tilt = agent.horizon if horizon is None else float(horizon)
    if not forceAction:
        target = _place_on_floor(sim.world, target, tilt)
    agent.position = target
    agent.yaw = turn % 360.0
    agent.horizon = tilt
    agent.standing = agent.standing if standing is None else standing
    sim.world.carry()


@action("TeleportFull", overloads=(("position",), ("x", "y", "z")))
def teleport_full(
    sim: Simulation,
    rotation: Vector3,
    horizon: float,
    standing: bool,
    position: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    forceAction: bool = False,
) -> None:
    """Put the agent elsewhere; everything must be given."""
    teleport(sim, position, x, y, z, rotation, horizon, standing, forceAction)


def _place_on_floor(world: World, target: Array, horizon: float) -> Array:
    """Return the target (3,) at the agent's height above the floor."""
    lowest = world.agent.max_down
    if not -MAX_UP <= horizon <= lowest:
        raise ActionError(f"Each horizon must be in [{-MAX_UP:g}:{lowest:g}]. You gave {horizon}.")
    low, high = world.scene_bounds()
    if np.any(target[[0, 2]] < low[[0, 2]]) or np.any(target[[0, 2]] > high[[0, 2]]):
        raise ActionError("Teleport target out of bounds: ({:.4f}, {:.4f}, {:.4f})".format(*target))
    placed = np.array([target[0], world.standing_height, target[2]])
    off = abs(float(target[1] - placed[1]))
    if off > _STEP_HEIGHT:
        raise ActionError(
            "After teleporting and adjusting agent position to floor, there was too large a change"
            f"({off:.4f} > {_STEP_HEIGHT}) in the y component."
            " Consider using `forceAction=true` if you'd like to teleport anyway."
        )
    obstacle = blocking_object(world, placed) or agent_at(world, placed)
    if obstacle is not None or not world.nav.can_stand(target[0], target[2]):
        raise ActionError(
            f"Cannot teleport due to hitting object '{obstacle or nearest_name(world, placed)}'."
        )
    return placed
