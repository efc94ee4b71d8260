"""Moving the arm, or the agent with its arm, along a path; what stops it, in Unity's words."""

import math

import numpy as np

from infthor_sim.arm.arm import Arm
from infthor_sim.arm.obstacles import ArmObstacles, arm_obstacles
from infthor_sim.arm.sweep import Stance, first_contact, take_stance
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array
from infthor_sim.simulation import Simulation

Contact = tuple[int, str]  # index of a stance in a path, and id or name of what is in the way there


def agent_arm(sim: Simulation) -> Arm:
    """Return the agent's arm; actions that call this are registered only for modes with one."""
    assert sim.world.arm is not None
    return sim.world.arm


def obstacles(sim: Simulation) -> ArmObstacles:
    """Return what stops the agent's arm."""
    rows, _, names = sim.views.primitives()
    return arm_obstacles(sim.world, rows, names, sim.settings.mass_threshold)


def follow(
    sim: Simulation,
    path: list[Stance],
    target: str,
    return_to_start: bool,
    body_contact: Contact | None = None,
) -> None:
    """Take the stances of a path, as far as nothing is in the way.

    Args:
        path: the stances, without the present one.
        target: end of the path, as the message names it.
        return_to_start: go back after a collision; else agent and arm stay at the last free stance.
        body_contact: first contact of the agent's body on the path; None if it has none.
    """
    arm = agent_arm(sim)
    checked = path if body_contact is None else path[: body_contact[0] + 1]
    # At the same stance the arm's contact is reported before the body's.
    contact = first_contact(sim.world, arm, checked, obstacles(sim)) or body_contact
    if contact is None:
        take_stance(sim.world, arm, path[-1])
        return
    step, name = contact
    if not return_to_start and step > 0:
        take_stance(sim.world, arm, path[step - 1])
    raise ActionError(_collision_text(sim, name, target))


def _collision_text(sim: Simulation, name: str, target: str) -> str:
    item = sim.world.objects.get(name)
    if item is None and not any(o.name == name for o in sim.world.objects.values()):
        return (
            f"Collided with static structure in scene: '{name}', could not reach target: "
            f"'{target}'."
        )
    label = name if item is None else item.name
    return f"Collided with static sim object: '{label}', could not reach target: '{target}'."


def position_text(point: Array) -> str:
    """Return a position (3,) as Unity prints it."""
    return "({:.2f}, {:.2f}, {:.2f})".format(*point)


def quaternion_text(turn: Array) -> str:
    """Return a rotation (3, 3) as Unity prints its quaternion."""
    w = math.sqrt(max(1.0 + float(np.trace(turn)), 0.0)) / 2
    # The diagonal gives the components' sizes, also near half a turn, where w is 0; the skew part
    # gives their signs.
    squares = np.maximum(1.0 + 2.0 * np.diag(turn) - np.trace(turn), 0.0)
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    x, y, z = np.sqrt(squares) / 2 * np.where(skew < 0, -1.0, 1.0)
    return f"({x:.5f}, {y:.5f}, {z:.5f}, {w:.5f})"
