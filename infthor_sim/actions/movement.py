# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Moving, turning, looking, and putting the agent elsewhere."""

import math
from functools import partial

import numpy as np

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.agent import MAX_UP
from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.geometry import Array
from infthor_sim.physics.crowd import agent_at, agent_on_way
from infthor_sim.physics.obstacles import blocking_object, held_object_blocks, nearest_name
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

# degrees from the agent's own
_DIRECTIONS = {"Ahead": 0.0, "Back": 180.0, "Left": -90.0, "Right": 90.0}
_STEP_HEIGHT = 0.05  # metres that a teleport's y may be off the floor


def walk(
    direction: float,
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
    """Walk, within `maxAgentsDistance` metres of the object `objectId` if both are passed."""
    size = sim.settings.grid_size if moveMagnitude is None else moveMagnitude
    if size <= 0:
        raise ActionError("moveMagnitude must be > 0")
    agent = sim.world.agent
    angle = math.radians(agent.yaw + direction)
    offset = np.array([math.sin(angle), 0.0, math.cos(angle)]) * size
    target = agent.position + offset
    if (
        sim.settings.snap_to_grid
        and abs(size / sim.settings.grid_size - round(size / sim.settings.grid_size)) < 1e-6
    ):
        # Rounding takes off the noise of sine and cosine, which would add up over a long walk on
        # the grid.
        target = np.array(
            [round(float(target[0]), 5), float(target[1]), round(float(target[2]), 5)]
        )
    if objectId and maxAgentsDistance > 0:
        away = float(np.linalg.norm(sim.world.get(objectId).position - target))
        if away > maxAgentsDistance:
            raise ActionError(
                f"Agent movement would bring it beyond the max distance of {objectId}: {away:.4f}"
            )
    _check_path(sim, target, offset, forceAction)
    other = None if allowAgentsToIntersect else agent_on_way(sim.world, target)
    if other is not None:
        raise _blocked(sim, other, offset)
    agent.position = target
    sim.world.carry(manualInteract)


for _name, _angle in _DIRECTIONS.items():
    action(f"Move{_name}")(partial(walk, _angle))


def _check_path(sim: Simulation, target: Array, offset: Array, force: bool) -> None:
    world = sim.world
    start = world.agent.position
    obstacle = blocking_object(world, target)
    if obstacle is not None:
        raise _blocked(sim, obstacle, offset)
    if not world.nav.can_walk((start[0], start[2]), (target[0], target[2])):
        raise _blocked(sim, nearest_name(world, target), offset)
    held = world.agent.held
    if not force and held is not None and held_object_blocks(world, target):
        raise _blocked(sim, held, offset)


def _blocked(sim: Simulation, obstacle: str, offset: Array) -> ActionError:
    by = ", ".join(f"{component:.4f}" for component in offset)
    return ActionError(f"{obstacle} is blocking Agent {sim.world.active} from moving by ({by}).")


def turn(
    sign: float,
    sim: Simulation,
    degrees: float | None = None,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
    manualInteract: bool = False,
    forceAction: bool = False,
) -> None:
    """Turn by some degrees to the right, or with `sign` -1 to the left."""
    # Unity takes 0 degrees, its default, for `rotateStepDegrees`.
    amount = sim.settings.rotate_step if degrees is None or degrees == 0 else degrees
    agent = sim.world.agent
    # The second modulus turns a 360.0 that rounding produced into 0.
    agent.yaw = round((agent.yaw + sign * amount) % 360.0, 6) % 360.0
    sim.world.carry(manualInteract)


for _name, _sign in (("RotateRight", 1.0), ("RotateLeft", -1.0)):
    action(_name)(partial(turn, _sign))


def _look(
    name: str,
    sign: float,
    sim: Simulation,
    degrees: float = 30.0,
    speed: float = 1.0,
    forceAction: bool = False,
    manualInteract: bool = False,
) -> None:
    if degrees < 0:
        raise ActionError(
            f"{name} action requires positive degree value. Invalid value used: {degrees}"
        )
    agent = sim.world.agent
    target = round(agent.horizon + sign * degrees, 4)
    if target > agent.max_down:
        text = f"can't look down beyond {agent.max_down:g} degrees below the forward horizon"
        raise ActionError(text, ErrorCode.LOOK_DOWN_LIMIT)
    if target < -MAX_UP:
        raise ActionError(
            f"can't look up beyond {MAX_UP:g} degrees above the forward horizon",
            ErrorCode.LOOK_UP_LIMIT,
        )
    agent.horizon = target
    sim.world.carry(manualInteract)


for _name, _sign in (("LookDown", 1.0), ("LookUp", -1.0)):
    action(_name)(partial(_look, _name, _sign))


@action("RotateLook")
def rotate_look(sim: Simulation, rotation: Vector3 | None = None, horizon: float = 0.0) -> None:
    """Turn the agent to a rotation and its camera to a horizon, whatever both were before."""
    agent = sim.world.agent
    agent.yaw = float((rotation or Vector3()).get("y", 0.0)) % 360.0
    agent.horizon = float(horizon)
    sim.world.carry()


@action("Crouch", modes=HAND_MODES)
def crouch(sim: Simulation) -> None:
    """Lower the camera."""
    if not sim.world.agent.standing:
        raise ActionError("Already crouching")
    sim.world.agent.standing = False


@action("Stand", modes=HAND_MODES)
def stand(sim: Simulation) -> None:
    """Raise the camera again."""
    if sim.world.agent.standing:
        raise ActionError("Already standing")
    sim.world.agent.standing = True


@action("Pass", "Done", "NoOp", "Stop")
def wait(sim: Simulation) -> None:
    """Do nothing."""


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
    yaw = agent.yaw if rotation is None else float(rotation.get("y", 0.0))
    tilt = agent.horizon if horizon is None else float(horizon)
    if not forceAction:
        target = _place_on_floor(sim.world, target, tilt)
    agent.position = target
    agent.yaw = yaw % 360.0
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
