"""What servers' numbers mean: actions as steps of an arm, an arm's hand as a state.

Axes are those of the robot's base: x forward, y left, z up.

To add a format: a gripper or a state in `model_adapters/options/policies.py`, a rotation in
`_ROTATIONS` here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.quantities import MOST
from model_adapters.options.policies import GRIPPERS, SocketPolicyOptions
from model_adapters.protocols import ArmDelta, HandState

Numbers = npt.NDArray[np.float64]

_UNIT = (-1.0, 1.0)
_TURN = 3.1  # radians, which a range of angles includes
_PARTS = ["position", "rotation", "gripper"]


class Spec(msgspec.Struct, frozen=True):
    """How a server declares one part of what it takes or gives: a format's name, and a range."""

    format: str
    range: tuple[float, float] | None = None


# Of a server that declares nothing: robosuite's, which LIBERO's policies are trained on.
UNDECLARED = {
    "position": Spec("delta_xyz", _UNIT),
    "rotation": Spec("axis_angle", _UNIT),
    "gripper": Spec("binary_close_positive"),
}


@dataclass(frozen=True)
class Convention:
    """How numbers code a step: three of a movement, those of a rotation, one of the gripper.

    Attributes:
        metres: what 1 of a movement stands for.
        rotation: format of the rotation.
        radians: what 1 of its angles stands for; quaternions and matrices are not scaled.
        gripper: format of the gripper.
        padded: whether further numbers may follow, which mean nothing.
    """

    metres: float
    rotation: str
    radians: float
    gripper: str
    padded: bool

    def deltas(self, server: str, actions: Any) -> tuple[ArmDelta, ...]:
        """Return actions, one or several, as steps of an arm (ModelError if they are none)."""
        n_turn, to_angles = _ROTATIONS[self.rotation]
        chunk = _chunk(server, actions, 4 + n_turn, self.padded)
        moved, turned, gripper, _ = np.split(chunk, [3, 3 + n_turn, 4 + n_turn], axis=1)
        problem = f"{server} gives rotations that are none: {turned.tolist()}"
        with wrap_errors(problem, "see its log", catch=ValueError, raise_as=ModelError):
            angles = to_angles(turned, self.radians)
        closed, opened = GRIPPERS[self.gripper]
        opening = np.clip((gripper - closed) / (opened - closed), 0.0, 1.0)
        steps = np.hstack((moved * self.metres, angles, opening)).tolist()
        return tuple(ArmDelta(tuple(step[:3]), tuple(step[3:6]), step[6]) for step in steps)


def convention_of(
    server: str, declared: Mapping[str, Spec], options: SocketPolicyOptions
) -> Convention:
    """Return how actions are read; what the user gives comes before what the server declares.

    Args:
        server: for messages.
        declared: its parts in order; none, or one that is "raw", is as `UNDECLARED`.
        options: scales and gripper.

    Raises:
        ModelError: they are no steps from where the hand is, or of an unknown format.
    """
    if [spec.format for spec in declared.values()] in ([], ["raw"]):
        declared = UNDECLARED
    said = f"{server} declares " + ", ".join(f"{it} {declared[it].format}" for it in declared)
    if list(declared) != _PARTS or declared["position"].format != "delta_xyz":
        raise ModelError(f"{said}; only position delta_xyz, rotation, gripper are run here")
    position, rotation, gripper = declared.values()
    if rotation.format not in _ROTATIONS:
        raise ModelError(f"{said}; a rotation must be one of {', '.join(_ROTATIONS)}")
    grips = options.gripper or gripper.format
    if grips not in GRIPPERS:
        raise ModelError(f"{said}; say which it is: gripper={'|'.join(GRIPPERS)}")
    metres = options.translation_scale or _scale(server, "translation", position, 0.05)
    radians = options.rotation_scale or _scale(server, "rotation", rotation, 0.5)
    return Convention(metres, rotation.format, radians, grips, options.padded)


def state_vector(hand: HandState, form: str) -> npt.NDArray[np.float32]:
    """Return a hand's state as eight numbers, in one of the formats `STATES`."""
    turn = Rotation.from_euler("xyz", hand.rotation)
    rotations = {
        "euler3_gripper2": (*hand.rotation, hand.gripper),
        "axisangle3_gripper2": (*turn.as_rotvec(), hand.gripper),
        "quat4_gripper1": turn.as_quat(),
    }
    numbers = (*hand.position, *rotations[form.removeprefix("eef_pos3_")], hand.gripper)
    return np.array(numbers, dtype=np.float32)


def _scale(server: str, part: str, spec: Spec, usual: float) -> float:
    """Return what 1 stands for: `usual` if numbers are from -1 to 1, else a metre or radian."""
    if spec.range == _UNIT:
        return usual
    if spec.range is None or (part == "rotation" and spec.range[1] > _TURN):
        return 1.0
    low, high = spec.range
    raise ModelError(
        f"{server} declares a {part} from {low:g} to {high:g}, of no known unit; say what 1 stands "
        f"for: {part}_scale=NUMBER"
    )


def _chunk(server: str, actions: Any, size: int, padded: bool) -> Numbers:
    problem = f"{server} answers without actions of numbers"
    with wrap_errors(problem, "see its log", catch=(TypeError, ValueError), raise_as=ModelError):
        given = np.atleast_2d(np.asarray(actions))
        if given.dtype.kind not in "fiu":
            raise ValueError(f"{type(actions).__name__} of {given.dtype}")
    chunk = given.astype(np.float64)
    fits = chunk.shape[-1] >= size if padded else chunk.shape[-1] == size
    if chunk.ndim != 2 or not len(chunk) or not fits:
        shape = list(chunk.shape)
        raise ModelError(f"{server} gives actions of shape {shape}, not rows of {size} numbers")
    if not (np.abs(chunk) <= MOST).all():
        raise ModelError(f"{server} gives an action that is not finite; see its log")
    return chunk


def _euler(turn: Rotation) -> Numbers:
    return np.asarray(turn.as_euler("xyz"), dtype=np.float64)


def _from_columns(numbers: Numbers, _: float) -> Numbers:
    """Return the angles of matrices whose first two columns are given, interleaved."""
    first = numbers[:, ::2]
    second = numbers[:, 1::2]
    third = np.cross(first, second)
    if not np.linalg.norm(third, axis=1).all():
        raise ValueError("two columns of a matrix are parallel")
    matrices = np.stack([first, np.cross(third, first), third], axis=2)
    return _euler(Rotation.from_matrix(matrices / np.linalg.norm(matrices, axis=1, keepdims=True)))


# By format: how many numbers, and how rows of them become roll, pitch and yaw, given a scale.
_ROTATIONS: dict[str, tuple[int, Callable[[Numbers, float], Numbers]]] = {
    "euler_xyz": (3, lambda numbers, scale: numbers * scale),
    "axis_angle": (3, lambda numbers, scale: _euler(Rotation.from_rotvec(numbers * scale))),
    "quaternion_xyzw": (4, lambda numbers, _: _euler(Rotation.from_quat(numbers))),
    "rot6d_interleaved": (6, _from_columns),
}
