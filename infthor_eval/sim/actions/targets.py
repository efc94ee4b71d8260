"""Finding the object that an action names, as AI2-THOR's default agent does."""

from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.simulation import Simulation

__all__ = ["BY_ID_OR_PIXEL", "check_in_frame", "held_object", "interactable", "object_at"]

BY_ID_OR_PIXEL = (("objectId",), ("x", "y"))
"""Forms of the actions that take an object by its id or by where it is seen."""


def interactable(sim: Simulation, object_id: str | None, force: bool, x: float | None, y: float | None) -> SimObject:
    """The object with this id, or the one shown at (x, y), shares of the frame from its top left.

    Raises:
        ActionError: there is no such object, or the agent does not see it near enough.
    """
    if object_id is None:
        assert x is not None
        assert y is not None
        object_id = object_at(sim, x, y)
        if object_id is None:
            raise ActionError(f"No SimObject found at (x: {x}, y: {y})")
    found = sim.world.get(object_id)
    if not force and object_id not in sim.visible() and not sim.visible_inside(found):
        raise ActionError("Target object not found within the specified visibility.", ErrorCode.NOT_VISIBLE)
    return found


def held_object(sim: Simulation) -> SimObject | None:
    """What the agent holds."""
    return None if sim.world.held is None else sim.world.objects[sim.world.held]


def check_in_frame(x: float, y: float) -> None:
    """Refuse a point outside the frame.

    Raises:
        ActionError: it is outside.
    """
    if not (0 <= x <= 1 and 0 <= y <= 1):
        raise ActionError(f"x/y must be in [0:1], not (x={x}, y={y})")


def object_at(sim: Simulation, x: float, y: float) -> str | None:
    """Id of the object shown at (x, y), shares of the frame from its top left; None for walls and the void.

    Raises:
        ActionError: the point is outside the frame.
    """
    check_in_frame(x, y)
    picture = sim.view()
    row = min(int((1 - y) * sim.height), sim.height - 1)
    index = picture.instances[row, min(int(x * sim.width), sim.width - 1)]
    name = picture.names[index] if index >= 0 else ""
    return name if name in sim.world.objects else None
