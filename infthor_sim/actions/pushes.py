"""Pushing and pulling: loose things slide until friction or something stops them, or they fall."""

from functools import partial

import numpy as np

from infthor_sim.actions.registry import action
from infthor_sim.actions.targets import BY_ID_OR_PIXEL, interactable
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.physics.sliding import LIGHTEST, slide
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation

_FRAME = 0.02  # seconds that Unity applies the force
_FRICTION = 0.5
_GRAVITY = 9.81
_DEFAULT_FORCE = 200.0  # newtons


def _push(
    angle: float,
    sim: Simulation,
    objectId: str | None = None,
    x: float | None = None,
    y: float | None = None,
    moveMagnitude: float = _DEFAULT_FORCE,
    forceAction: bool = False,
) -> None:
    directional_push(sim, moveMagnitude, angle, objectId, x, y, forceAction)


for _name, _angle in (("PushObject", 0.0), ("PullObject", 180.0)):
    action(_name, overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)(partial(_push, _angle))


@action("DirectionalPush", overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)
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
    target = interactable(sim, objectId, forceAction, x, y)
    if target.object_id in sim.world.held_ids():
        raise ActionError("Please use Throw for an item in the Agent's Hand")
    if not (target.type.pickupable or target.type.moveable):
        raise ActionError(
            "Target object must be either Pickupable or Moveable to have force applied to it!"
        )
    if moveMagnitude <= 0:
        raise ActionError(f"moveMagnitude must be > 0, not {moveMagnitude}")
    direction: Array = yaw_matrix(sim.world.agent.yaw + pushAngle)[:, 2]
    # The force acts for one frame; the speed it gives is then lost to friction: v^2 = 2 * friction
    # * g * distance.
    speed = moveMagnitude * _FRAME / max(target.type.mass, LIGHTEST)
    slide(sim.world, target, direction, float(np.square(speed) / (2 * _FRICTION * _GRAVITY)))
    sim.world.mark_changed()
