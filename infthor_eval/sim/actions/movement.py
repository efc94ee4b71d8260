# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Moving, turning and looking."""

import math
from typing import NamedTuple

import numpy as np

from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.agent import MAX_DOWN, MAX_UP
from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.obstacles import blocking_object, held_object_blocks, nearest_name
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


@action("MoveAhead")
def move_ahead(
    sim: Simulation,
    moveMagnitude: float | None = None,
    objectId: str | None = None,
    maxAgentsDistance: float = -1.0,
    forceAction: bool = False,
    manualInteract: bool = False,
    allowAgentsToIntersect: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move along the agent's forward direction, by `gridSize` unless told."""
    _move(sim, 0.0, moveMagnitude, _Terms(forceAction, manualInteract, objectId, maxAgentsDistance))


@action("MoveBack")
def move_back(
    sim: Simulation,
    moveMagnitude: float | None = None,
    objectId: str | None = None,
    maxAgentsDistance: float = -1.0,
    forceAction: bool = False,
    manualInteract: bool = False,
    allowAgentsToIntersect: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move backwards."""
    _move(sim, 180.0, moveMagnitude, _Terms(forceAction, manualInteract, objectId, maxAgentsDistance))


@action("MoveLeft")
def move_left(
    sim: Simulation,
    moveMagnitude: float | None = None,
    objectId: str | None = None,
    maxAgentsDistance: float = -1.0,
    forceAction: bool = False,
    manualInteract: bool = False,
    allowAgentsToIntersect: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move to the left without turning."""
    _move(sim, -90.0, moveMagnitude, _Terms(forceAction, manualInteract, objectId, maxAgentsDistance))


@action("MoveRight")
def move_right(
    sim: Simulation,
    moveMagnitude: float | None = None,
    objectId: str | None = None,
    maxAgentsDistance: float = -1.0,
    forceAction: bool = False,
    manualInteract: bool = False,
    allowAgentsToIntersect: bool = False,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Move to the right without turning."""
    _move(sim, 90.0, moveMagnitude, _Terms(forceAction, manualInteract, objectId, maxAgentsDistance))


@action("RotateRight")
def rotate_right(
    sim: Simulation,
    degrees: float | None = None,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
    manualInteract: bool = False,
    forceAction: bool = False,
) -> None:
    """Turn clockwise, by `rotateStepDegrees` unless told."""
    _rotate(sim, degrees, 1.0, manualInteract)


@action("RotateLeft")
def rotate_left(
    sim: Simulation,
    degrees: float | None = None,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
    manualInteract: bool = False,
    forceAction: bool = False,
) -> None:
    """Turn counter-clockwise."""
    _rotate(sim, degrees, -1.0, manualInteract)


@action("LookDown")
def look_down(sim: Simulation, degrees: float = 30.0, forceAction: bool = False, manualInteract: bool = False) -> None:
    """Tilts the camera down."""
    _look(sim, degrees, 1.0, manualInteract)


@action("LookUp")
def look_up(sim: Simulation, degrees: float = 30.0, forceAction: bool = False, manualInteract: bool = False) -> None:
    """Tilts the camera up."""
    _look(sim, degrees, -1.0, manualInteract)


@action("RotateLook")
def rotate_look(sim: Simulation, rotation: Vector3 | None = None, horizon: float = 0.0) -> None:
    """Turn to a rotation and tilt the camera to a horizon, whatever both were before."""
    agent = sim.world.agent
    agent.yaw = float((rotation or Vector3()).get("y", 0.0)) % 360.0
    agent.horizon = float(horizon)
    _carry(sim)


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


class _Terms(NamedTuple):
    """On what terms the agent moves.

    Attributes:
        force: what it holds does not keep it back.
        keep_grip: what it holds stays as it was moved in the hand.
        leash: id of an object that it must stay near; None for none.
        reach: how near, metres; not positive for any distance.
    """

    force: bool
    keep_grip: bool
    leash: str | None
    reach: float


def _move(sim: Simulation, turn: float, magnitude: float | None, terms: _Terms) -> None:
    size = sim.settings.grid_size if magnitude is None else magnitude
    if size <= 0:
        raise ActionError("moveMagnitude must be > 0")
    agent = sim.world.agent
    angle = math.radians(agent.yaw + turn)
    offset = np.array([math.sin(angle), 0.0, math.cos(angle)]) * size
    target = agent.position + offset
    if sim.settings.snap_to_grid and abs(size / sim.settings.grid_size - round(size / sim.settings.grid_size)) < 1e-6:
        target = _clean(target)
    _check_leash(sim, target, terms)
    _check_way(sim, target, offset, terms.force)
    agent.position = target
    _carry(sim, terms.keep_grip)


def _check_leash(sim: Simulation, target: Array, terms: _Terms) -> None:
    if not terms.leash or terms.reach <= 0:
        return
    away = float(np.linalg.norm(sim.world.get(terms.leash).position - target))
    if away > terms.reach:
        raise ActionError(f"Agent movement would bring it beyond the max distance of {terms.leash}: {away:.4f}")


def _check_way(sim: Simulation, target: Array, offset: Array, force: bool) -> None:
    start = sim.world.agent.position
    by = f"({offset[0]:.4f}, {offset[1]:.4f}, {offset[2]:.4f})"
    obstacle = blocking_object(sim.world, target)
    if obstacle is not None:
        raise ActionError(f"{obstacle} is blocking Agent 0 from moving by {by}.")
    if not sim.world.nav.walk((start[0], start[2]), (target[0], target[2])):
        raise ActionError(f"{nearest_name(sim.world, target)} is blocking Agent 0 from moving by {by}.")
    if not force and sim.world.held is not None and held_object_blocks(sim.world, target):
        raise ActionError(f"{sim.world.held} is blocking Agent 0 from moving by {by}.")


def _clean(position: Array) -> Array:
    """Take the float noise off positions that should be on the grid."""
    return np.array([round(float(position[0]), 5), float(position[1]), round(float(position[2]), 5)])


def _rotate(sim: Simulation, degrees: float | None, sign: float, keep_grip: bool) -> None:
    amount = sim.settings.rotate_step if degrees is None or degrees == 0 else degrees
    agent = sim.world.agent
    agent.yaw = round((agent.yaw + sign * amount) % 360.0, 6) % 360.0
    _carry(sim, keep_grip)


def _look(sim: Simulation, degrees: float, sign: float, keep_grip: bool) -> None:
    if degrees < 0:
        verb = "LookDown" if sign > 0 else "LookUp"
        raise ActionError(f"{verb} action requires positive degree value. Invalid value used: {degrees}")
    agent = sim.world.agent
    target = round(agent.horizon + sign * degrees, 4)
    if target > MAX_DOWN:
        raise ActionError(
            f"can't look down beyond {MAX_DOWN:g} degrees below the forward horizon", ErrorCode.LOOK_DOWN_LIMIT
        )
    if target < -MAX_UP:
        raise ActionError(f"can't look up beyond {MAX_UP:g} degrees above the forward horizon", ErrorCode.LOOK_UP_LIMIT)
    agent.horizon = target
    _carry(sim, keep_grip)


def _carry(sim: Simulation, keep_grip: bool = False) -> None:
    """Take what the agent holds along with it."""
    sim.world.carry(keep_grip)
    sim.world.touch()
