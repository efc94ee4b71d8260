"""The call that puts the agent at a pose."""

from typing import Any

from infthor_eval.thor.view import AgentPose

__all__ = ["teleport_call"]


def teleport_call(pose: AgentPose, *, force: bool = True) -> dict[str, Any]:
    """The call of 5.x that puts the agent at a pose.

    Args:
        pose: where to; whether it stands is left out where the agent cannot crouch.
        force: whether it is put there even where it does not fit; else the simulator may refuse.

    Returns:
        `{"action": ..., arguments}` as `Simulator.step(**call)` takes it.
    """
    at = pose.position
    call: dict[str, Any] = {
        "action": "TeleportFull",
        "position": {"x": at.x, "y": at.y, "z": at.z},
        "rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
        "horizon": pose.horizon,
        "forceAction": force,
    }
    return call if pose.standing is None else {**call, "standing": pose.standing}
