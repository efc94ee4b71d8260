"""What the agent and the user can do, one module per theme; importing this package registers them all."""

from infthor_eval.sim.actions import (  # noqa: F401 - imported to be registered
    arm,
    arm_physics,
    arm_teleport,
    arm_walking,
    cameras,
    hand,
    interaction,
    looks,
    movement,
    placing,
    pushes,
    queries,
    restoring,
    scenes,
    snapshots,
    standing,
    states,
    teleport,
    telling,
)
from infthor_eval.sim.actions.registry import Action, bind, names

__all__ = ["Action", "bind", "names"]
