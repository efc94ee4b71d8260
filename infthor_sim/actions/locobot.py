# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Walking and turning of RoboTHOR's locobot: never quite straight, nor quite as far as asked."""

from functools import partial

from infthor_sim.actions.movement import teleport, turn, walk
from infthor_sim.actions.registry import Vector3, action
from infthor_sim.errors import ActionError
from infthor_sim.settings import LOCOBOT
from infthor_sim.simulation import Simulation

# degrees from the robot's own
_AHEAD = {"Ahead": 0.0, "Back": 180.0}
_ASIDE = {"Left": -90.0, "Right": 90.0}


def _roll(
    direction: float,
    sim: Simulation,
    moveMagnitude: float | None = None,
    noise: float = 0.0,
    objectId: str | None = None,
    maxAgentsDistance: float = -1.0,
    forceAction: bool = False,
    allowAgentsToIntersect: bool = False,
) -> None:
    """Roll on; the robot turns a little with each step, even with one that something stops."""
    size = sim.settings.grid_size if moveMagnitude is None else moveMagnitude
    drift = sim.settings.noise
    agent = sim.world.agent
    veer = float(sim.random.normal(drift.turn_mean, drift.turn_deviation / 2))
    agent.yaw = round((agent.yaw + veer) % 360.0, 6) % 360.0
    walk(
        direction,
        sim,
        size + noise + float(sim.random.normal(drift.step_mean, drift.step_deviation)),
        objectId,
        maxAgentsDistance,
        forceAction,
        allowAgentsToIntersect=allowAgentsToIntersect,
    )


def _roll_aside(direction: float, sim: Simulation, moveMagnitude: float | None = None) -> None:
    if not sim.settings.sideways:
        raise ActionError(
            "Controller does not support horizontal movement by default. Set "
            "AllowHorizontalMovement to true on the Controller."
        )
    _roll(direction, sim, moveMagnitude)


for _name, _angle in _AHEAD.items():
    action(f"Move{_name}", modes=(LOCOBOT,))(partial(_roll, _angle))
for _name, _angle in _ASIDE.items():
    action(f"Move{_name}", modes=(LOCOBOT,))(partial(_roll_aside, _angle))


def _turn(
    sign: float,
    sim: Simulation,
    degrees: float | None = None,
    noise: float = 0.0,
    forceAction: bool = False,
) -> None:
    amount = sim.settings.rotate_step if degrees is None or degrees == 0 else degrees
    drift = sim.settings.noise
    error = noise + float(sim.random.normal(drift.turn_mean, drift.turn_deviation))
    turn(1.0, sim, sign * amount + error)


for _name, _sign in (("RotateRight", 1.0), ("RotateLeft", -1.0)):
    action(_name, modes=(LOCOBOT,))(partial(_turn, _sign))


@action("TeleportFull", overloads=(("position",), ("x", "y", "z")), modes=(LOCOBOT,))
def teleport_full(
    sim: Simulation,
    rotation: Vector3,
    horizon: float,
    position: Vector3 | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
) -> None:
    """Put the robot elsewhere; it cannot crouch, so that `standing` need not be given."""
    teleport(sim, position, x, y, z, rotation, horizon, None, forceAction)
