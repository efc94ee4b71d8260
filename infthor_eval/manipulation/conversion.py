"""From a policy's 7 degrees of freedom to calls of AI2-THOR's arm (docs/manipulation.md).

A policy moves the end effector in the frame of a robot's base: x forward, y left, z up,
right-handed. AI2-THOR's arm is moved in the frame "armBase": x right, y up, z forward, left-handed.
A change of handedness reverses the sense of turns. So yaw changes its sign. Pitch keeps it, as its
axis is reversed too, and so does roll, as AI2-THOR counts it the other way.

To add or change what a policy's seven numbers do: here; their limits and scales in
`tasks/manipulation/`.
"""

import math
from dataclasses import dataclass
from typing import Any

from model_adapters import ArmDelta

Call = dict[str, Any]
_STILL = 1e-6  # metres or degrees; a smaller movement is left out


@dataclass(frozen=True)
class Conversion:
    """How a step of a policy moves the arm.

    Attributes:
        translation_scale: factor of translations.
        max_step: maximum length of a translation in metres; a longer one is shortened.
        rotation: whether the wrist is turned.
        return_to_start: whether the arm goes back after a collision (AI2-THOR's default), or stays
            where it collided.
    """

    translation_scale: float = 1.0
    max_step: float = 0.1
    rotation: bool = True
    return_to_start: bool = True

    def calls(self, delta: ArmDelta) -> list[Call]:
        """Return the movements of a step in order, without the gripper; none if the arm stays."""
        calls = [self._translation(delta), self._rotation(delta) if self.rotation else None]
        return [
            call | {"returnToStart": self.return_to_start} for call in calls if call is not None
        ]

    def _translation(self, delta: ArmDelta) -> Call | None:
        x, y, z = [self.translation_scale * value for value in delta.translation]
        length = math.hypot(x, y, z)
        if length < _STILL:
            return None
        share = min(1.0, self.max_step / length)
        return {
            "action": "MoveArmRelative",
            "offset": {"x": -share * y, "y": share * z, "z": share * x},
        }

    @staticmethod
    def _rotation(delta: ArmDelta) -> Call | None:
        roll, pitch, yaw = map(math.degrees, delta.rotation)
        if max(map(abs, (roll, pitch, yaw))) < _STILL:
            return None
        return {"action": "RotateWristRelative", "pitch": pitch, "yaw": -yaw, "roll": roll}
