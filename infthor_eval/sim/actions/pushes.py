"""Pushing and pulling loose things: each slides till friction stops it, something is in its way, or it falls."""

import numpy as np

from infthor_eval.sim.actions.registry import action
from infthor_eval.sim.actions.targets import BY_ID_OR_PIXEL, interactable
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import Array, yaw_matrix
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.simulation import Simulation
from infthor_eval.sim.sliding import slide

__all__: list[str] = []

_FRAME = 0.02  # seconds that Unity applies the force
_FRICTION = 0.5
_GRAVITY = 9.81
_LIGHTEST = 0.05  # kilograms; records may have 0
_USUAL_PUSH = 200.0  # newtons


@action("PushObject", forms=BY_ID_OR_PIXEL)
def push(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    moveMagnitude: float = _USUAL_PUSH,
    forceAction: bool = False,
) -> None:
    """Push an object away from the agent with a force, newtons."""
    _push(sim, interactable(sim, objectId, forceAction, x, y), moveMagnitude, 0.0)


@action("PullObject", forms=BY_ID_OR_PIXEL)
def pull(
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    moveMagnitude: float = _USUAL_PUSH,
    forceAction: bool = False,
) -> None:
    """Pull an object towards the agent."""
    _push(sim, interactable(sim, objectId, forceAction, x, y), moveMagnitude, 180.0)


@action("DirectionalPush", forms=BY_ID_OR_PIXEL)
def directional_push(
    sim: Simulation,
    moveMagnitude: float,
    pushAngle: float,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    forceAction: bool = False,
) -> None:
    """Push an object in a direction, degrees clockwise from the agent's own."""
    _push(sim, interactable(sim, objectId, forceAction, x, y), moveMagnitude, pushAngle)


def _push(sim: Simulation, target: SimObject, force: float, angle: float) -> None:
    if target.object_id in sim.world.carried():
        raise ActionError("Please use Throw for an item in the Agent's Hand")
    if not (target.type.pickupable or target.type.moveable):
        raise ActionError("Target object must be either Pickupable or Moveable to have force applied to it!")
    if force <= 0:
        raise ActionError(f"moveMagnitude must be > 0, not {force}")
    direction: Array = yaw_matrix(sim.world.agent.yaw + angle)[:, 2]
    slide(sim.world, target, direction, _way(target, force))
    sim.world.touch()


def _way(target: SimObject, force: float) -> float:
    """Metres till friction stops what a force has set in motion."""
    speed = force * _FRAME / max(target.type.mass, _LIGHTEST)
    return float(np.square(speed) / (2 * _FRICTION * _GRAVITY))
