"""Putting the arm into a pose at once."""

from dataclasses import replace

import numpy as np

from infthor_eval.sim.actions.arm_motion import the_arm
from infthor_eval.sim.actions.registry import Vector3, action
from infthor_eval.sim.arm.sweep import Stance, assume, free, stance
from infthor_eval.sim.arm.turns import rotation as rotation_about
from infthor_eval.sim.errors import ActionError
from infthor_eval.sim.geometry import Array, to_array
from infthor_eval.sim.simulation import Simulation

__all__: list[str] = []


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
    """Bend the arm so at once; what is not given is as the arm is at rest.

    Args:
        sim: the simulation.
        position: of the wrist, metres, from the base or in the world.
        rotation: of the wrist likewise, an axis `x, y, z` and the angle `w` in degrees.
        armHeight: of the base above the agent's position, metres.
        elbowOrientation: degrees.
        worldRelative: whether position and rotation are the world's.
        forceAction: whether the arm may be in something then.
    """
    arm, rest = the_arm(sim), the_arm(sim).rig.rest()
    height = rest.base if armHeight is None else armHeight
    pose = replace(rest, base=float(height), elbow=float(elbowOrientation or 0.0) % 360.0)
    base = replace(arm, pose=pose).base(sim.world.agent)
    target = rest.wrist if position is None else to_array(position)
    turn = rest.turn if rotation is None else _turn(rotation)
    if worldRelative:
        target, turn = base.local(target), base.turn.T @ turn
    (pose,) = arm.rig.reaching([replace(pose, turn=turn)], target[None])
    now = stance(sim.world, arm)
    there = Stance(now.position, now.yaw, pose)
    if not forceAction and not free(sim.world, arm, there, sim.solids()):
        raise ActionError("collision detected at desired transform, cannot teleport")
    assume(sim.world, arm, there)


def _turn(rotation: dict[str, float]) -> Array:
    """The rotation (3, 3) of an axis and an angle.

    Raises:
        ActionError: there is no axis.
    """
    numbers = [rotation.get(key, 0.0) for key in "xyzw"]
    if not all(isinstance(n, int | float) and np.isfinite(n) for n in numbers) or not any(numbers[:3]):
        raise ActionError(f"rotation must have an axis x, y, z and an angle w, not {rotation}")
    axis = np.array(numbers[:3], dtype=float)
    return rotation_about(axis / np.linalg.norm(axis), numbers[3] % 360.0)
