"""Recorded low-level actions (AI2-THOR 2.1.0 form, as ALFRED and ∞-THOR store them) as calls of the 5.x
API."""

from typing import Any

from infthor_eval.formats.trajectory import LowAction
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.view import SimulatorView

__all__ = ["MissingObjectError", "degrees_of", "translate"]

_TURNS = {"RotateLeft": 90.0, "RotateRight": 90.0, "LookUp": 30.0, "LookDown": 30.0}


class MissingObjectError(LookupError):
    """A recorded action is about an object of a type that the scene does not have."""


def translate(low: LowAction, grounding: Grounding, view: SimulatorView) -> dict[str, Any]:
    """The call that does in 5.x what the recorded one did.

    Args:
        low: the recorded action.
        grounding: the episode's ids.
        view: the world now.

    Returns:
        `{"action": ..., arguments}` as `Simulator.step(**call)` takes it.

    Raises:
        MissingObjectError: the scene has no object of the type that the action is about.
    """
    recorded = low.api_action
    name = recorded.action
    if name in _TURNS:
        return {"action": name, "degrees": degrees_of(low)}
    call: dict[str, Any] = {"action": name}
    if recorded.move_magnitude is not None and name.startswith("Move"):
        call["moveMagnitude"] = recorded.move_magnitude
    # 2.1.0 names the held object and its receptacle, 5.x the receptacle alone.
    wanted = recorded.receptacle_id if name == "PutObject" else recorded.object_id
    if wanted is not None:
        found = grounding.ground(wanted, view)
        if found is None:
            raise MissingObjectError(f"{name}: the scene has no object for '{wanted}'")
        call["objectId"] = found
    if name == "PutObject":
        call |= {"forceAction": bool(recorded.force_action), "placeStationary": True}
    return call


def degrees_of(low: LowAction) -> float:
    """By how much a recorded turn turns: its own argument, the number in its name ("LookDown_15"), or 2.1.0's
    step."""
    if low.api_action.degrees is not None:
        return low.api_action.degrees
    name = low.discrete_action.action if low.discrete_action is not None else ""
    suffix = name.rpartition("_")[2]
    return float(suffix) if suffix.isdigit() else _TURNS[low.api_action.action]
