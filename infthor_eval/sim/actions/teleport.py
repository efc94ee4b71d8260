"""Putting the agent elsewhere."""

import numpy as np

from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.agent import MAX_DOWN, MAX_UP
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.obstacles import blocking_object, nearest_name
from infthor_eval.sim.simulation import Simulation
from infthor_eval.sim.world import World

__all__: list[str] = []

_STEP_HEIGHT = 0.05  # metres that a teleport's y may be off the floor


@action("Teleport", forms=((), ("x", "y", "z")))
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
    where = _place(sim.world, position, x, y, z)
    turn = agent.yaw if rotation is None else float(rotation.get("y", 0.0))
    tilt = agent.horizon if horizon is None else float(horizon)
    if not forceAction:
        where = _checked(sim.world, where, tilt)
    agent.position, agent.yaw, agent.horizon = where, turn % 360.0, tilt
    agent.standing = agent.standing if standing is None else standing
    sim.world.carry()
    sim.world.touch()


@action("TeleportFull", forms=(("position",), ("x", "y", "z")))
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


def _place(world: World, position: Vector3 | None, x: float | None, y: float | None, z: float | None) -> Array:
    """Where to (3,), by either form; a component that is not given stays."""
    given = position or {axis: value for axis, value in (("x", x), ("y", y), ("z", z)) if value is not None}
    return np.array([float(given.get(axis, now)) for axis, now in zip("xyz", world.agent.position, strict=True)])


def _checked(world: World, where: Array, horizon: float) -> Array:
    """The place as it is on the floor.

    Raises:
        ActionError: the agent cannot be there.
    """
    if not -MAX_UP <= horizon <= MAX_DOWN:
        raise ActionError(f"Each horizon must be in [{-MAX_UP:g}:{MAX_DOWN:g}]. You gave {horizon}.")
    low, high = world.scene_bounds()
    if np.any(where[[0, 2]] < low[[0, 2]]) or np.any(where[[0, 2]] > high[[0, 2]]):
        raise ActionError("Teleport target out of bounds: ({:.4f}, {:.4f}, {:.4f})".format(*where))
    floor = np.array([where[0], world.standing_height, where[2]])
    off = abs(float(where[1] - floor[1]))
    if off > _STEP_HEIGHT:
        raise ActionError(
            "After teleporting and adjusting agent position to floor, there was too large a change"
            f"({off:.4f} > {_STEP_HEIGHT}) in the y component."
            " Consider using `forceAction=true` if you'd like to teleport anyway."
        )
    obstacle = blocking_object(world, floor)
    if obstacle is not None or not world.nav.stands(where[0], where[2]):
        raise ActionError(f"Cannot teleport due to hitting object '{obstacle or nearest_name(world, floor)}'.")
    return floor
