"""SpatialVLA's action tokens: direction and length, rotation, gripper; three tokens a step."""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from infthor_eval.errors import ModelError
from model_adapters.policies.statistics import ACTION_SIZE, Actions

TOKENS_PER_STEP = 3
_GRIPPER_IDS = 2  # closed, open


class _Translation(msgspec.Struct, frozen=True):
    theta_bins: list[float]
    phi_bins: list[float]
    r_bins: list[float]


class _Rotation(msgspec.Struct, frozen=True):
    roll_bins: list[float]
    pitch_bins: list[float]
    yaw_bins: list[float]


class _BinPolicy(msgspec.Struct, frozen=True):
    translation: _Translation
    rotation: _Rotation


class _NumBins(msgspec.Struct, frozen=True):
    gripper: int
    translation: dict[str, int]
    rotation: dict[str, int]


class _ActionConfig(msgspec.Struct, frozen=True):
    num_bins: _NumBins
    use_spherical: bool


class CameraIntrinsics(msgspec.Struct, frozen=True):
    """Intrinsics of a camera for images of a given size in pixels."""

    width: int
    height: int
    intrinsic: list[list[float]]


class ProcessorConfig(msgspec.Struct, frozen=True):
    """`processor_config.json`.

    Attributes:
        action_chunk_size: steps of a chunk.
        action_config: numbers of bins.
        bin_policy: borders of the bins, in ascending order; one more than bins.
        intrinsic_config: cameras by dataset, and "default".
        statistics: statistics of actions by dataset.
    """

    action_chunk_size: int
    action_config: _ActionConfig
    bin_policy: _BinPolicy
    intrinsic_config: dict[str, CameraIntrinsics]
    statistics: dict[str, dict[str, object]]


@dataclass(frozen=True)
class SpatialBins:
    """Conversion of action ids to actions.

    Attributes:
        begin: id of the first action token.
        theta, phi, r: borders of the bins of a translation's polar angle, azimuth (radians) and
            length.
        roll, pitch, yaw: borders of the bins of a rotation.
    """

    begin: int
    theta: Sequence[float]
    phi: Sequence[float]
    r: Sequence[float]
    roll: Sequence[float]
    pitch: Sequence[float]
    yaw: Sequence[float]

    @classmethod
    def of(
        cls, config: ProcessorConfig, begin: int, n_tokens: int, pretrained: str
    ) -> "SpatialBins":
        """Return the bins of a checkpoint, by its first action token, their number and the config
        of its processor.
        """
        policy = config.bin_policy
        counts = config.action_config.num_bins
        axes = {**msgspec.to_builtins(policy.translation), **msgspec.to_builtins(policy.rotation)}
        expected = {**counts.translation, **counts.rotation}
        wrong = [name for name, borders in axes.items() if len(borders) - 1 != expected.get(name)]
        if wrong or not config.action_config.use_spherical or counts.gripper != _GRIPPER_IDS:
            raise ModelError(
                f"{pretrained}: bins and num_bins do not fit "
                f"({', '.join(wrong) or 'no spherical bins'})"
            )
        bins = cls(begin, *(tuple(axes[name]) for name in axes))
        if bins.action_ids[-1].stop != begin + n_tokens:
            raise ModelError(
                f"{pretrained} has {n_tokens} action tokens and {bins.action_ids[-1].stop - begin} "
                "bins"
            )
        return bins

    @property
    def action_ids(self) -> tuple[range, range, range]:
        """Ids of a step's three tokens: translations, rotations, gripper closed and open."""
        rotations = self.begin + _n(self.theta) * _n(self.phi) * _n(self.r)
        grippers = rotations + _n(self.roll) * _n(self.pitch) * _n(self.yaw)
        return (
            range(self.begin, rotations),
            range(rotations, grippers),
            range(grippers, grippers + _GRIPPER_IDS),
        )

    def decode(self, ids: Sequence[int]) -> Actions:
        """Return actions, (steps, 7), each number between -1 and 1, the gripper 0 or 1.

        A translation token is a bin of polar angle, azimuth and length; its centre is converted to
        x, y, z. The corner bins of large lengths reach beyond the unit cube, so translations are
        clipped.

        Args:
            ids: three ids per step, each among `action_ids` of its place.
        """
        first_ids = [allowed.start for allowed in self.action_ids]
        steps = np.array(ids).reshape(-1, TOKENS_PER_STEP) - first_ids
        theta, phi, r = _centres(steps[:, 0], self.theta, self.phi, self.r)
        xyz = [r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)]
        rotation = _centres(steps[:, 1], self.roll, self.pitch, self.yaw)
        actions: Actions = np.stack(
            [*np.clip(xyz, -1, 1), *rotation, steps[:, 2].astype(np.float64)], axis=1
        )
        assert actions.shape[1] == ACTION_SIZE
        return actions


def _n(borders: Sequence[float]) -> int:
    return len(borders) - 1


def _centres(index: np.ndarray, *axes: Sequence[float]) -> list[np.ndarray]:
    """Return the centres on three axes of bins, (steps,), numbered with the last axis fastest."""
    coordinates = np.unravel_index(index, [_n(axis) for axis in axes])
    return [
        (np.array(axis)[at] + np.array(axis)[at + 1]) / 2
        for at, axis in zip(coordinates, axes, strict=True)
    ]
