"""Putting the arm into a pose at once."""

from dataclasses import replace

import numpy as np

from infthor_sim.actions.arm_motion import agent_arm, obstacles
from infthor_sim.actions.registry import Vector3, action
from infthor_sim.arm.sweep import Stance, is_free, stance, take_stance
from infthor_sim.errors import ActionError
from infthor_sim.geometry import Array, axis_rotation, to_array
from infthor_sim.simulation import Simulation


@action("TeleportArm", modes=("arm",))
def teleport_arm(
    sim: Simulation,
    position: Vector3 | None = None,
    rotation: dict[str, float] | None = None,
    armHeight: float | None = None,
    elbowOrientation: float | None = None,
    worldRelative: bool = False,
    forceAction: bool = False,
) -> None:
    """Put the arm into a pose at once; what is not given is as in the resting pose.

    Args:
        position: position of the wrist, metres, from the base or in the world.
        rotation: rotation of the wrist, likewise: an axis `x, y, z` and the angle `w` in degrees.
        armHeight: height of the base above the agent's position, metres.
        elbowOrientation: angle of the elbow, degrees.
        worldRelative: position and rotation are in the world.
        forceAction: allow a pose in which the arm is in something.
    """
    arm = agent_arm(sim)
    rest = agent_arm(sim).rig.rest()
    height = rest.base if armHeight is None else armHeight
    pose = replace(rest, base=float(height), elbow=float(elbowOrientation or 0.0) % 360.0)
    base = replace(arm, pose=pose).base(sim.world.agent)
    target = rest.wrist if position is None else to_array(position)
    turn = rest.turn if rotation is None else _rotation_matrix(rotation)
    if worldRelative:
        target = base.local(target)
        turn = base.turn.T @ turn
    (pose,) = arm.rig.reach([replace(pose, turn=turn)], target[None])
    now = stance(sim.world, arm)
    there = Stance(now.position, now.yaw, pose)
    if not forceAction and not is_free(sim.world, arm, there, obstacles(sim)):
        raise ActionError("collision detected at desired transform, cannot teleport")
    take_stance(sim.world, arm, there)


def _rotation_matrix(rotation: dict[str, float]) -> Array:
    """Return the rotation (3, 3) of an axis and an angle."""
    numbers = [rotation.get(key, 0.0) for key in "xyzw"]
    if not all(isinstance(n, int | float) and np.isfinite(n) for n in numbers) or not any(
        numbers[:3]
    ):
        raise ActionError(f"rotation must have an axis x, y, z and an angle w, not {rotation}")
    axis = np.array(numbers[:3], dtype=float)
    return axis_rotation(axis / np.linalg.norm(axis), numbers[3] % 360.0)
