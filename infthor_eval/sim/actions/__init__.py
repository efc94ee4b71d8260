"""The actions of the protocol, one module per theme; importing this package registers them all."""

from infthor_eval.sim.actions import (  # noqa: F401 - imported to be registered
    agent_poses,
    appearance,
    arm,
    arm_physics,
    arm_teleport,
    arm_walking,
    cameras,
    hand,
    interaction,
    movement,
    object_filter,
    placing,
    pushes,
    queries,
    scene_state,
    scenes,
    snapshots,
    states,
    teleport,
)
from infthor_eval.sim.actions.registry import Action, action_names, bind

__all__ = ["Action", "action_names", "bind"]
