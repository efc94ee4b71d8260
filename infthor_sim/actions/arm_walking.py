# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Walking and turning of the arm agents, in small steps, until something is in the way."""

from functools import partial

import numpy as np

from infthor_sim.actions.arm_motion import (
    Contact,
    agent_arm,
    follow,
    position_text,
    quaternion_text,
)
from infthor_sim.actions.registry import action
from infthor_sim.arm.paths import STEP, shares
from infthor_sim.arm.sweep import Stance, stance
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, wrap_degrees, yaw_matrix
from infthor_sim.physics.obstacles import blocking_object, nearest_name
from infthor_sim.settings import ARM_MODES
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

_TURN_STEP = 1.15  # degrees: Unity turns by a radian a second, in frames of a fiftieth of a second
_MAX_STEPS = 2000  # of one walk, 40 m; the collision check holds all stances of a path in memory
# ahead, right
_DIRECTIONS = {"Ahead": (1.0, 0.0), "Back": (-1.0, 0.0), "Right": (0.0, 1.0), "Left": (0.0, -1.0)}


@action("MoveAgent", modes=ARM_MODES)
def move_agent(
    sim: Simulation,
    ahead: float = 0.0,
    right: float = 0.0,
    speed: float = 1.0,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Walk, metres ahead and to the right at once."""
    if ahead == 0 and right == 0:
        raise ActionError("Must specify ahead or right!")
    now = stance(sim.world, agent_arm(sim))
    way = yaw_matrix(now.yaw) @ np.array([right, 0.0, ahead])
    distance = float(np.linalg.norm(way))
    if distance > _MAX_STEPS * STEP:
        raise ActionError(
            f"The agent walks at most {_MAX_STEPS * STEP:g} m at once, not {distance:.4g}"
        )
    path = [
        Stance(now.position + way * share, now.yaw, now.pose) for share in shares(distance, STEP)
    ]
    contact = _body_contact(sim.world, [s.position for s in path])
    follow(sim, path, position_text(now.position + way), returnToStart, contact)


def _body_contact(world: World, positions: list[Array]) -> Contact | None:
    """Return the first position at which the agent cannot be, and what is there; None: all free."""
    # After a forced teleport the agent may be where it cannot stand. It may leave then: positions
    # count as blocked only once it has been at a free one, and the last one in any case.
    was_free = world.nav.can_stand(world.agent.position[0], world.agent.position[2])
    for step, position in enumerate(positions):
        obstacle = blocking_object(world, position)
        is_free = obstacle is None and world.nav.can_stand(position[0], position[2])
        if not is_free and (was_free or step == len(positions) - 1):
            return step, obstacle or nearest_name(world, position)
        was_free = was_free or is_free
    return None


def _walk(
    direction: tuple[float, float],
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
    size = sim.settings.grid_size if moveMagnitude is None else moveMagnitude
    move_agent(
        sim, direction[0] * size, direction[1] * size, speed, returnToStart, disableRendering
    )


for _name, _direction in _DIRECTIONS.items():
    action(f"Move{_name}", modes=ARM_MODES)(partial(_walk, _direction))


@action("RotateAgent", modes=ARM_MODES)
def rotate_agent(
    sim: Simulation,
    degrees: float,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    """Turn clockwise, degrees, the shortest way."""
    now = stance(sim.world, agent_arm(sim))
    turn = wrap_degrees(degrees)
    end = round((now.yaw + turn) % 360.0, 6) % 360.0
    yaws = [(now.yaw + turn * share) % 360.0 for share in shares(abs(turn), _TURN_STEP)[:-1]]
    path = [Stance(now.position, yaw, now.pose) for yaw in (*yaws, end)]
    follow(sim, path, quaternion_text(yaw_matrix(end)), returnToStart)


def _turn(
    sign: float,
    sim: Simulation,
    degrees: float | None = None,
    manualInteract: bool = False,
    forceAction: bool = False,
    speed: float = 1.0,
    waitForFixedUpdate: bool = False,
    returnToStart: bool = True,
    disableRendering: bool = True,
) -> None:
    amount = sim.settings.rotate_step if degrees is None else degrees
    rotate_agent(sim, sign * amount, speed, waitForFixedUpdate, returnToStart, disableRendering)


for _name, _sign in (("RotateRight", 1.0), ("RotateLeft", -1.0)):
    action(_name, modes=ARM_MODES)(partial(_turn, _sign))
