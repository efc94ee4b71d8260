# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Moving, turning, dropping and throwing the object in the hand."""

from functools import partial

import numpy as np

from infthor_sim.actions.registry import Vector3, action
from infthor_sim.actions.targets import held_object
from infthor_sim.agent import Grip
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, euler_matrix, to_array
from infthor_sim.physics.clearance import obstacle_at
from infthor_sim.physics.falling import let_fall
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation

_THROW_REACH = 0.9  # metres in front of the agent at which a thrown thing lands
_DIRECTIONS = {
    "Ahead": (0.0, 0.0, 1.0), "Right": (1.0, 0.0, 0.0), "Up": (0.0, 1.0, 0.0),
    "Back": (0.0, 0.0, -1.0), "Left": (-1.0, 0.0, 0.0), "Down": (0.0, -1.0, 0.0),
}  # fmt: skip


@action("DropHandObject", "DropHeldObject", modes=HAND_MODES)
def drop(sim: Simulation, forceAction: bool = False, autoSimulation: bool = True) -> None:
    """Let the held object fall to whatever is below it."""
    _let_go(sim, 0.0)


@action("DropHeldObjectAhead", modes=HAND_MODES)
def drop_ahead(
    sim: Simulation,
    forceAction: bool = False,
    autoSimulation: bool = True,
    randomMagnitude: float = 0.0,
) -> None:
    """Drop the held object in front of the agent, farther than its arms hold it."""
    _let_go(sim, _THROW_REACH)


@action("ThrowObject", modes=HAND_MODES)
def throw(
    sim: Simulation,
    moveMagnitude: float = 0.0,
    forceAction: bool = False,
    autoSimulation: bool = True,
) -> None:
    """Drop the held object a step in front of the agent; there is no flight."""
    _let_go(sim, _THROW_REACH)


def _let_go(sim: Simulation, ahead: float) -> None:
    held = held_object(sim, "Nothing in agent's hand to drop!")
    forward = sim.world.agent.camera_matrix()[:, 2] * (1.0, 0.0, 1.0)
    sim.world.release()
    let_fall(sim.world, held, held.center + forward * ahead)


@action("MoveHeldObject", modes=HAND_MODES)
def move_held_object(
    sim: Simulation,
    ahead: float = 0.0,
    right: float = 0.0,
    up: float = 0.0,
    forceVisible: bool = False,
) -> None:
    """Move the held object along the camera's axes, metres."""
    _move_held(sim, np.array([right, up, ahead]), forceVisible)


def _move_along(
    direction: Array, sim: Simulation, moveMagnitude: float, forceVisible: bool = False
) -> None:
    _move_held(sim, direction * moveMagnitude, forceVisible)


for _name, _direction in _DIRECTIONS.items():
    action(f"MoveHeldObject{_name}", f"MoveHand{_name}", modes=HAND_MODES)(
        partial(_move_along, np.array(_direction))
    )


@action("RotateHeldObject", overloads=((), ("rotation",)), modes=HAND_MODES)
def rotate_held_object(
    sim: Simulation,
    pitch: float = 0.0,
    yaw: float = 0.0,
    roll: float = 0.0,
    rotation: Vector3 | None = None,
) -> None:
    """Turn the hand, with what it holds, about its own axes, or to a rotation to the camera.

    The axes are the hand's and not the object's: an object that lies in the hand stays lying in it.
    """
    held_object(sim, "Need to be holding something to rotate it!")
    hand = sim.world.agent.hand
    # Unity's roll is positive to the right, the reverse of its rotation about z.
    relative = hand.turn @ euler_matrix((pitch, yaw, -roll))
    turned = relative if rotation is None else euler_matrix(to_array(rotation))
    sim.world.move_hand(Grip(hand.offset, turned))
    sim.world.mark_changed()


def _move_held(sim: Simulation, step: Array, force_visible: bool) -> None:
    """Move the held object by `step` (right, up, ahead) if it stays in reach, in view and clear."""
    held = held_object(sim, "Agent can only move hand if holding an item")
    world = sim.world
    offset = world.agent.camera_matrix() @ step
    if (
        np.linalg.norm(held.position + offset - world.agent.camera_position())
        > sim.settings.visibility_distance
    ):
        raise ActionError(
            "The target position is out of range- object cannot move outside of max visibility "
            "distance."
        )
    if not force_visible and not sim.vision.in_frame((held.center + offset)[None])[0]:
        raise ActionError("The target position is not in the Agent's Viewport!")
    obstacle = obstacle_at(world, held, offset)
    if obstacle is not None:
        raise ActionError(f"{obstacle} is blocking the held object from moving there.")
    hand = world.agent.hand
    world.move_hand(Grip(hand.offset + step, hand.turn))
    world.mark_changed()
