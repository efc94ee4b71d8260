"""Carrying out a movement of the arm, or of the agent with its arm, and telling what stopped it as Unity does."""

import math

import numpy as np

from infthor_eval.sim.arm.arm import Arm
from infthor_eval.sim.arm.sweep import Stance, assume, first_contact
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import Array
from infthor_eval.sim.simulation import Simulation

__all__ = ["follow", "place_text", "the_arm", "turn_text"]

Contact = tuple[int, str]  # step of a path, and id or name of what is met there


def the_arm(sim: Simulation) -> Arm:
    """The agent's arm, which its mode must have."""
    assert sim.world.arm is not None
    return sim.world.arm


def follow(
    sim: Simulation, path: list[Stance], target: str, return_to_start: bool, body: Contact | None = None
) -> None:
    """Go along a path as far as nothing is in the way.

    Args:
        sim: the simulation.
        path: the stances, without the present one.
        target: what the message calls the end of the path.
        return_to_start: whether agent and arm go back after a collision; else they stay before it.
        body: what the agent's body meets on the path.

    Raises:
        ActionError: something is in the way.
    """
    arm = the_arm(sim)
    met = first_contact(sim.world, arm, path if body is None else path[: body[0] + 1], sim.solids())
    met = body if met is None else met
    if met is None:
        assume(sim.world, arm, path[-1])
        return
    step, name = met
    if not return_to_start and step > 0:
        assume(sim.world, arm, path[step - 1])
    raise ActionError(_collision(sim, name, target))


def _collision(sim: Simulation, name: str, target: str) -> str:
    known = sim.world.objects.get(name)
    if known is None and not any(o.name == name for o in sim.world.objects.values()):
        return f"Collided with static structure in scene: '{name}', could not reach target: '{target}'."
    shown = name if known is None else known.name
    return f"Collided with static sim object: '{shown}', could not reach target: '{target}'."


def place_text(point: Array) -> str:
    """A place (3,) as Unity prints it."""
    return "({:.2f}, {:.2f}, {:.2f})".format(*point)


def turn_text(turn: Array) -> str:
    """A rotation (3, 3) as Unity prints its quaternion."""
    w = math.sqrt(max(1.0 + float(np.trace(turn)), 0.0)) / 2
    squares = np.maximum(1.0 + 2.0 * np.diag(turn) - np.trace(turn), 0.0)
    x, y, z = (
        np.sqrt(squares)
        / 2
        * np.where(np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) < 0, -1.0, 1.0)
    )
    return f"({x:.5f}, {y:.5f}, {z:.5f}, {w:.5f})"
