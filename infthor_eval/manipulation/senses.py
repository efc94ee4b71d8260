"""What a policy with episodes is told beside its view: a camera at the wrist, the hand's state.

To add a camera: its pose here, and its name among `Cameras` in `options.py`.
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from infthor_eval.errors import SimulatorError
from infthor_eval.manipulation.geometry import offset, point_of, xyz
from infthor_eval.manipulation.kinds import Senses
from infthor_eval.thor.frames import FrameKeeper
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ArmState, SimulatorView
from model_adapters import ArmObservation, HandState

WRIST = 0  # id of the third-party camera


def look(senses: Senses, simulator: Simulator) -> SimulatorView:
    """Bring the camera to the wrist if there is one, and return the world with its frame."""
    view = simulator.view
    if not senses.wrist or view.arm is None:
        return view
    action = "Update" if simulator.metadata["thirdPartyCameras"] else "Add"
    seen = simulator.step(f"{action}ThirdPartyCamera", **_wrist_camera(view.arm))
    if not seen.success:
        raise SimulatorError(f"a camera at the wrist is refused: {seen.error}")
    return seen


def observe(
    senses: Senses, view: SimulatorView, step: int, frames: FrameKeeper
) -> ArmObservation | None:
    """Return what a policy is told after so many steps; None for an agent without vision."""
    image = frames.keep(view)
    if image is None or view.arm is None:
        return None
    wrist = frames.keep_from(WRIST, view) if senses.wrist else None
    return ArmObservation(image, wrist, hand_state(view.arm) if senses.state else None, step)


def hand_state(arm: ArmState) -> HandState:
    """Return the state of a hand.

    AI2-THOR's frame of the arm's base is x right, y up, z forward, left-handed. A change of
    handedness reverses the sense of turns.
    """
    joint = arm.joints[-1]
    x, y, z = point_of(joint.root_relative_position)
    turn = joint.root_relative_rotation
    turned = Rotation.from_rotvec(-math.radians(turn.w) * np.array((turn.z, -turn.x, turn.y)))
    roll, pitch, yaw = turned.as_euler("xyz").tolist()
    return HandState((z, 0.0 - x, y), (roll, pitch, yaw), 0.0 if arm.held else 1.0)


def _wrist_camera(arm: ArmState) -> dict[str, dict[str, float]]:
    """Return the pose of a camera at the wrist that looks where the hand points."""
    right, up, ahead = offset(point_of(arm.wrist), point_of(arm.sphere_center))
    yaw = math.degrees(math.atan2(right, ahead))
    down = math.degrees(math.atan2(-up, math.hypot(right, ahead)))
    return {"position": xyz(point_of(arm.wrist)), "rotation": xyz((down, yaw, 0.0))}
