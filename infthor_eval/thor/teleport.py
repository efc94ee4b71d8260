"""The call that teleports the agent."""

from typing import Any

from msgspec.structs import asdict

from infthor_eval.thor.view import AgentPose

__all__ = ["teleport_call"]


def teleport_call(pose: AgentPose, *, force: bool = True) -> dict[str, Any]:
    """Return the 5.x call that teleports the agent to a pose; unless forced, it may be refused for
    a collision."""
    call: dict[str, Any] = {
        "action": "TeleportFull",
        "position": asdict(pose.position),
        "rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
        "horizon": pose.horizon,
        "forceAction": force,
    }
    return call if pose.standing is None else {**call, "standing": pose.standing}
