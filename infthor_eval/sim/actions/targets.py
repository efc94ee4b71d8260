"""Finding the object that an action names, as AI2-THOR's default agent does."""

from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.objects import SimObject
from infthor_eval.sim.simulation import Simulation

__all__ = ["held_object", "interactable", "object_at"]


def interactable(sim: Simulation, object_id: str | None, force: bool, x: float | None, y: float | None) -> SimObject:
    """The object with this id, or the one shown at (x, y), shares of the frame from its top left.

    Raises:
        ActionError: neither or both are given, there is no such object, or the agent does not see it near enough.
    """
    if object_id is None:
        if x is None or y is None:
            raise ActionError("objectId, or x and y, must be given.", ErrorCode.MISSING_ARGUMENTS)
        object_id = object_at(sim, x, y)
        if object_id is None:
            raise ActionError(f"No object is at x: {x}, y: {y}.")
    elif x is not None or y is not None:
        raise ActionError("Provide either objectId or x and y, not both.", ErrorCode.AMBIGUOUS_ACTION)
    found = sim.world.get(object_id)
    if not force and object_id not in sim.visible() and not sim.visible_inside(found):
        raise ActionError("Target object not found within the specified visibility.", ErrorCode.NOT_VISIBLE)
    return found


def held_object(sim: Simulation) -> SimObject | None:
    """What the agent holds."""
    return None if sim.world.held is None else sim.world.objects[sim.world.held]


def object_at(sim: Simulation, x: float, y: float) -> str | None:
    """Id of the object shown at (x, y), shares of the frame from its top left; None for walls and the void.

    Raises:
        ActionError: the point is outside the frame.
    """
    if not (0 <= x <= 1 and 0 <= y <= 1):
        raise ActionError("x/y must be in [0:1]")
    picture = sim.view()
    row = min(int((1 - y) * sim.height), sim.height - 1)
    index = picture.instances[row, min(int(x * sim.width), sim.width - 1)]
    name = picture.names[index] if index >= 0 else ""
    return name if name in sim.world.objects else None
