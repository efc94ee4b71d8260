"""Pushing and pulling: loose things slide until friction or something stops them, or they fall."""

from functools import partial

import numpy as np

from infthor_sim.actions.registry import action
from infthor_sim.actions.targets import BY_ID_OR_PIXEL, interactable
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, yaw_matrix
from infthor_sim.objects import SimObject
from infthor_sim.physics.clearance import obstacles_at
from infthor_sim.physics.falling import assign_parent, is_over, let_fall
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation
from infthor_sim.world import World

_FRAME = 0.02  # seconds that Unity applies the force
_FRICTION = 0.5
_GRAVITY = 9.81
_DEFAULT_FORCE = 200.0  # newtons
_STEP = 0.02  # metres between two collision checks
_LIGHTEST = 0.05  # kilograms; some recorded objects have a mass of 0
# metres; no room is much larger, and a strong push of a light object would go on for kilometres
_FARTHEST = 5.0


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
    speed = moveMagnitude * _FRAME / max(target.type.mass, _LIGHTEST)
    _slide(sim.world, target, direction, float(np.square(speed) / (2 * _FRICTION * _GRAVITY)))
    sim.world.mark_changed()


def _slide(world: World, item: SimObject, direction: Array, distance: float) -> None:
    """Move an object, with its contents, along `direction` (3,) for at most `distance` metres.

    It takes loose things in its way along, which costs it way in proportion to their masses. It
    stops at anything else and at the walls of something closed. What is then beyond the edge of
    what it stands on falls.
    """
    step = direction * _STEP
    left = min(distance, _FARTHEST)
    moved = {item.object_id: item}
    while left >= _STEP:
        pushed = _pushed(world, item, step, {})
        if pushed is None:
            break
        moved |= pushed
        world.shift(pushed.values(), step)
        left -= (
            _STEP
            * sum(max(o.type.mass, _LIGHTEST) for o in pushed.values())
            / max(item.type.mass, _LIGHTEST)
        )
        support = _support(world, item)
        if support is not None and not is_over(support, item.center):
            break
    for other in moved.values():
        support = _support(world, other)
        if support is not None and not is_over(support, other.center):
            let_fall(world, other, other.center)
        elif other.type.pickupable:
            assign_parent(world, other)


def _support(world: World, item: SimObject) -> SimObject | None:
    return None if item.parent is None else world.objects[item.parent]


def _pushed(
    world: World, item: SimObject, step: Array, pushed: dict[str, SimObject]
) -> dict[str, SimObject] | None:
    """Return an object and the loose things it takes along, by id; None if one is stopped."""
    support = _support(world, item)
    if support is not None and world.is_hidden(item) and not is_over(support, item.center + step):
        return None  # the wall of something closed
    pushed = {**pushed, item.object_id: item}
    for name in obstacles_at(world, item, step):
        other = next((o for o in world.objects.values() if o.name == name), None)
        if other is None or not other.type.pickupable:
            return None
        if other.object_id in pushed:
            continue
        further = _pushed(world, other, step, pushed)
        if further is None:
            return None
        pushed = further
    return pushed
