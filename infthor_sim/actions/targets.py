"""The object that an action names by id or pixel, resolved as AI2-THOR's default agent does."""

from collections.abc import Callable

from infthor_sim.actions.registry import action
from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.objects import SimObject
from infthor_sim.settings import HAND_MODES
from infthor_sim.simulation import Simulation

BY_ID_OR_PIXEL = (("objectId",), ("x", "y"))
"""Forms of the actions that take an object by its id or by where it is seen."""

ObjectFunction = Callable[[Simulation, SimObject], None]


def object_action(*names: str) -> Callable[[ObjectFunction], ObjectFunction]:
    """Register a function of one object as an action; its only arguments say which object it is."""

    def register(function: ObjectFunction) -> ObjectFunction:
        def run(
            sim: Simulation,
            objectId: str | None = None,
            x: float | None = None,
            y: float | None = None,
            forceAction: bool = False,
        ) -> None:
            function(sim, interactable(sim, objectId, forceAction, x, y))

        action(*names, overloads=BY_ID_OR_PIXEL, modes=HAND_MODES)(run)
        return function

    return register


def interactable(
    sim: Simulation, object_id: str | None, force: bool, x: float | None, y: float | None
) -> SimObject:
    """Return the object with this id, or that at (x, y), shares of the frame from its top left."""
    if object_id is None:
        assert x is not None
        assert y is not None
        object_id = object_at(sim, x, y)
        if object_id is None:
            raise ActionError(f"No SimObject found at (x: {x}, y: {y})")
    target = sim.world.get(object_id)
    if (
        not force
        and object_id not in sim.vision.visible_ids()
        and not sim.vision.visible_in_container(target)
    ):
        raise ActionError(
            "Target object not found within the specified visibility.", ErrorCode.NOT_VISIBLE
        )
    return target


def held_object(sim: Simulation, message: str) -> SimObject:
    """Return what the agent holds in its hand."""
    if sim.world.agent.held is None:
        raise ActionError(message, ErrorCode.NOT_IN_INVENTORY)
    return sim.world.objects[sim.world.agent.held]


def check_in_frame(x: float, y: float) -> None:
    """Refuse a point outside the frame."""
    if not (0 <= x <= 1 and 0 <= y <= 1):
        raise ActionError(f"x/y must be in [0:1], not (x={x}, y={y})")


def object_at(sim: Simulation, x: float, y: float) -> str | None:
    """Return the id of the object at (x, y), shares of the frame from its top left, or None."""
    check_in_frame(x, y)
    picture = sim.views.agent_view()
    height, width = picture.instances.shape
    # Pictures are stored with the bottom row first, as the wire wants them; the action counts from
    # the top.
    index = picture.instances[
        min(int((1 - y) * height), height - 1), min(int(x * width), width - 1)
    ]
    name = picture.names[index] if index >= 0 else ""
    return name if name in sim.world.objects else None
