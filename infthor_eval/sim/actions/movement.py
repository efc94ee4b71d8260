# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Moving, turning, looking and teleporting the agent."""

import math

import numpy as np

from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.geometry import Array, level_gaps, to_array, to_xyz
from infthor_eval.sim.obstacles import blocking_object, held_object_blocks
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []

_MAX_DOWN, _MAX_UP = 60.0, 30.0


@action("MoveAhead")
def move_ahead(
    sim: Simulation, moveMagnitude: float | None = None, noise: float = 0.0, forceAction: bool = False
) -> None:
    """Move along the agent's forward direction, by `gridSize` unless told."""
    _move(sim, 0.0, moveMagnitude, forceAction)


@action("MoveBack")
def move_back(
    sim: Simulation, moveMagnitude: float | None = None, noise: float = 0.0, forceAction: bool = False
) -> None:
    """Move backwards."""
    _move(sim, 180.0, moveMagnitude, forceAction)


@action("MoveLeft")
def move_left(
    sim: Simulation, moveMagnitude: float | None = None, noise: float = 0.0, forceAction: bool = False
) -> None:
    """Move to the left without turning."""
    _move(sim, -90.0, moveMagnitude, forceAction)


@action("MoveRight")
def move_right(
    sim: Simulation, moveMagnitude: float | None = None, noise: float = 0.0, forceAction: bool = False
) -> None:
    """Move to the right without turning."""
    _move(sim, 90.0, moveMagnitude, forceAction)


@action("RotateRight")
def rotate_right(sim: Simulation, degrees: float | None = None, forceAction: bool = False) -> None:
    """Turn clockwise, by `rotateStepDegrees` unless told."""
    _rotate(sim, degrees, 1.0)


@action("RotateLeft")
def rotate_left(sim: Simulation, degrees: float | None = None, forceAction: bool = False) -> None:
    """Turn counter-clockwise."""
    _rotate(sim, degrees, -1.0)


@action("LookDown")
def look_down(sim: Simulation, degrees: float = 30.0, forceAction: bool = False) -> None:
    """Tilts the camera down."""
    _look(sim, degrees, 1.0)


@action("LookUp")
def look_up(sim: Simulation, degrees: float = 30.0, forceAction: bool = False) -> None:
    """Tilts the camera up."""
    _look(sim, degrees, -1.0)


@action("Crouch")
def crouch(sim: Simulation) -> None:
    """Lowers the camera."""
    if not sim.world.agent.standing:
        raise ActionError("Already crouching")
    sim.world.agent.standing = False
    sim.world.touch()


@action("Stand")
def stand(sim: Simulation) -> None:
    """Raise the camera again."""
    if sim.world.agent.standing:
        raise ActionError("Already standing")
    sim.world.agent.standing = True
    sim.world.touch()


@action("Pass", "Done", "NoOp", "Stop")
def wait(sim: Simulation) -> None:
    """Does nothing."""


@action("Teleport")
def teleport(
    sim: Simulation,
    position: Vector3 | None = None,
    rotation: Vector3 | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
) -> None:
    """Put the agent elsewhere; what is not given stays as it is."""
    agent = sim.world.agent
    where = agent.position.copy()
    for index, axis in enumerate("xyz"):
        if position is not None and axis in position:
            where[index] = float(position[axis])
    turn = agent.yaw if rotation is None else float(rotation.get("y", 0.0))
    _teleport(sim, where, turn, agent.horizon if horizon is None else horizon, standing, forceAction)


@action("TeleportFull")
def teleport_full(
    sim: Simulation,
    position: Vector3,
    rotation: Vector3,
    horizon: float,
    standing: bool,
    forceAction: bool = False,
) -> None:
    """Put the agent elsewhere; everything must be given."""
    _teleport(sim, to_array(position), float(rotation.get("y", 0.0)), horizon, standing, forceAction)


def _move(sim: Simulation, turn: float, magnitude: float | None, force: bool) -> None:
    size = sim.settings.grid_size if magnitude is None or magnitude == 0 else magnitude
    if size < 0:
        raise ActionError(f"moveMagnitude must be positive, not {size}")
    agent = sim.world.agent
    angle = math.radians(agent.yaw + turn)
    offset = np.array([math.sin(angle), 0.0, math.cos(angle)]) * size
    target = agent.position + offset
    if sim.settings.snap_to_grid and abs(size / sim.settings.grid_size - round(size / sim.settings.grid_size)) < 1e-6:
        target = _clean(target)
    _check_way(sim, target, offset, force)
    agent.position = target
    _carry(sim)


def _check_way(sim: Simulation, target: Array, offset: Array, force: bool) -> None:
    start = sim.world.agent.position
    by = f"({offset[0]:.4f}, {offset[1]:.4f}, {offset[2]:.4f})"
    obstacle = blocking_object(sim.world, target)
    if obstacle is not None:
        raise ActionError(f"{obstacle} is blocking Agent 0 from moving by {by}.")
    if not sim.world.nav.walk((start[0], start[2]), (target[0], target[2])):
        raise ActionError(f"{_nearest_name(sim, target)} is blocking Agent 0 from moving by {by}.")
    if not force and sim.world.held is not None and held_object_blocks(sim.world, target):
        raise ActionError(f"{sim.world.held} is blocking Agent 0 from moving by {by}.")


def _nearest_name(sim: Simulation, point: Array) -> str:
    """Name of the standing thing nearest to `point`, which is what the agent ran into."""
    best = ("Wall", 0.6)
    for item in sim.world.objects.values():
        low, high = item.bounds()
        if item.type.pickupable or item.object_type == "Floor" or low[1] > 1.6 or high[1] < 0.2:
            continue
        gap = float(level_gaps(point[[0, 2]], low, high))
        if gap < best[1]:
            best = (item.name, gap)
    return best[0]


def _clean(position: Array) -> Array:
    """Take the float noise off positions that should be on the grid."""
    return np.array([round(float(position[0]), 5), float(position[1]), round(float(position[2]), 5)])


def _rotate(sim: Simulation, degrees: float | None, sign: float) -> None:
    amount = sim.settings.rotate_step if degrees is None or degrees == 0 else degrees
    agent = sim.world.agent
    agent.yaw = round((agent.yaw + sign * amount) % 360.0, 6) % 360.0
    _carry(sim)


def _look(sim: Simulation, degrees: float, sign: float) -> None:
    if degrees < 0:
        verb = "LookDown" if sign > 0 else "LookUp"
        raise ActionError(f"{verb} action requires positive degree value. Invalid value used: {degrees}")
    agent = sim.world.agent
    target = round(agent.horizon + sign * degrees, 4)
    if target > _MAX_DOWN:
        raise ActionError(
            f"can't look down beyond {_MAX_DOWN:g} degrees below the forward horizon", ErrorCode.LOOK_DOWN_LIMIT
        )
    if target < -_MAX_UP:
        raise ActionError(
            f"can't look up beyond {_MAX_UP:g} degrees above the forward horizon", ErrorCode.LOOK_UP_LIMIT
        )
    agent.horizon = target
    _carry(sim)


def _teleport(sim: Simulation, where: Array, yaw: float, horizon: float, standing: bool | None, force: bool) -> None:
    agent = sim.world.agent
    if not force and not -_MAX_UP <= horizon <= _MAX_DOWN:
        raise ActionError(f"Each horizon must be in [{-_MAX_UP:g}:{_MAX_DOWN:g}]. You gave {horizon}.")
    if not force:
        low, high = sim.world.scene_bounds()
        if np.any(where[[0, 2]] < low[[0, 2]]) or np.any(where[[0, 2]] > high[[0, 2]]):
            raise ActionError(f"Teleport target: {to_xyz(where)} is not in the scene bounds")
        obstacle = blocking_object(sim.world, where)
        if obstacle is not None or not sim.world.nav.stands(where[0], where[2]):
            raise ActionError(f"Cannot teleport due to hitting object '{obstacle or _nearest_name(sim, where)}'.")
    agent.position, agent.yaw, agent.horizon = where, yaw % 360.0, float(horizon)
    if standing is not None:
        agent.standing = standing
    _carry(sim)


def _carry(sim: Simulation) -> None:
    """Take what the agent holds along with it."""
    sim.world.carry()
    sim.world.touch()
