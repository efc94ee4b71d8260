"""Conversion of recorded actions (AI2-THOR 2.1.0, as in ALFRED and ∞-THOR) to calls of 5.x."""

from typing import Any

from infthor_eval.formats.trajectory import LowAction
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.view import SimulatorView

# Default angles of 2.1.0, degrees.
_TURNS = {"RotateLeft": 90.0, "RotateRight": 90.0, "LookUp": 30.0, "LookDown": 30.0}


class MissingObjectError(LookupError):
    """The scene has no object of the type that a recorded action needs."""


def translate(low: LowAction, grounding: Grounding, view: SimulatorView) -> dict[str, Any]:
    """Return the 5.x call with the effect of a recorded action.

    Returns:
        `{"action": ..., arguments}` for `Simulator.step(**call)`.

    Raises:
        MissingObjectError: the scene has no object of the type that the action needs.
    """
    recorded = low.api_action
    name = recorded.action
    if name in _TURNS:
        return {"action": name, "degrees": degrees_of(low)}
    call: dict[str, Any] = {"action": name}
    if recorded.move_magnitude is not None and name.startswith("Move"):
        call["moveMagnitude"] = recorded.move_magnitude
    # PutObject of 2.1.0 has the held object and its receptacle, that of 5.x only the receptacle.
    recorded_id = recorded.receptacle_id if name == "PutObject" else recorded.object_id
    if recorded_id is not None:
        object_id = grounding.ground(recorded_id, view)
        if object_id is None:
            raise MissingObjectError(f"{name}: the scene has no object for '{recorded_id}'")
        call["objectId"] = object_id
    if name == "PutObject":
        call |= {"forceAction": bool(recorded.force_action), "placeStationary": True}
    return call


def degrees_of(low: LowAction) -> float:
    """Return the angle of a recorded turn: its argument, the number in its name ("LookDown_15"), or
    2.1.0's default."""
    if low.api_action.degrees is not None:
        return low.api_action.degrees
    name = low.discrete_action.action if low.discrete_action is not None else ""
    suffix = name.rpartition("_")[2]
    return float(suffix) if suffix.isdigit() else _TURNS[low.api_action.action]
