"""Whether a policy acts as another implementation of it does, behind a server."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.tables import Column, Row, Table
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.http.adapter import HttpPolicy
from model_adapters.protocols import ArmDelta, Policy
from model_adapters.registry import has_option, load

__all__ = [
    "INSTRUCTIONS",
    "ParityReport",
    "compare_policies",
    "frames_in_folder",
    "load_policy",
    "reference_policy",
    "synthetic_frames",
]

INSTRUCTIONS = ("pick up the mug", "pick up the apple", "Put the knife in the drawer")
_PICTURES = (".png", ".jpg", ".jpeg")
_NOISE = 4


@dataclass(frozen=True)
class _ParityRow:
    instruction: str
    n_frames: int
    n_steps: tuple[int, int]
    translation: float
    rotation: float
    gripper: float

    @property
    def largest(self) -> float:
        return max(self.translation, self.rotation, self.gripper)


@dataclass(frozen=True)
class ParityReport:
    """How far two implementations are apart.

    Attributes:
        name: of the policy.
        rows: the largest differences of each instruction.
        tolerance: what is taken for equal.
    """

    name: str
    rows: tuple[_ParityRow, ...]
    tolerance: float

    @property
    def equal(self) -> bool:
        """Whether every action agrees."""
        return all(row.largest <= self.tolerance for row in self.rows)

    def table(self) -> Table:
        """The largest differences, an instruction a row."""
        columns = ("instruction", "frames", "steps", "metres", "radians", "gripper")
        rows = tuple(Row(_cells(row)) for row in self.rows)
        verdict = "equal" if self.equal else "they differ"
        note = f"Largest differences of actions; up to {self.tolerance:g} they are taken for equal: {verdict}."
        title = f"{self.name} and its reference"
        return Table(title, tuple(Column(name, name != "instruction") for name in columns), rows, (note,))


def load_policy(name: str, options: Mapping[str, str]) -> Policy:
    """The policy to compare; its chunks are compared as they are, not averaged, unless the options say otherwise.

    Raises:
        UsageError: there is no such model, it is no policy, or the options do not fit.
        ModelError: it cannot be loaded.
    """
    plain = {"ensemble": "none"} if has_option(name, "ensemble") else {}
    policy = load(name, {**plain, **options}, seed=0)
    if not isinstance(policy, Policy):
        policy.close()
        raise UsageError(f"{name} is no policy; compare openvla or spatialvla")
    return policy


def reference_policy(url: str, unnorm_key: str | None) -> HttpPolicy:
    """The other implementation.

    Args:
        url: of a server of the `/act` convention.
        unnorm_key: the dataset that it is to scale actions to.

    Raises:
        UsageError: that is no address.
    """
    try:
        return HttpPolicy("reference", VlaHttpOptions(url=url, unnorm_key=unnorm_key))
    except ValueError as error:
        raise UsageError(f"--reference-url: {error}") from error


def compare_policies(
    ours: Policy, theirs: Policy, frames: Sequence[FrameRef], instructions: Sequence[str], tolerance: float
) -> ParityReport:
    """Have both act on the same frames and instructions, each frame as the first of an episode.

    Raises:
        ModelError: one of them cannot act.
        DataError: a frame cannot be read.
    """
    rows = tuple(_row(ours, theirs, frames, instruction) for instruction in instructions)
    return ParityReport(ours.name, rows, tolerance)


def frames_in_folder(folder: Path) -> list[FrameRef]:
    """The pictures of a folder, by name.

    Raises:
        DataError: it has none, or cannot be read.
    """
    found = sorted(path for path in folder.iterdir() if path.suffix.lower() in _PICTURES) if folder.is_dir() else []
    if not found:
        raise DataError(f"{folder}: holds no pictures ({', '.join(_PICTURES)}); give a folder of frames")
    return [FrameRef(path) for path in found]


@contextmanager
def synthetic_frames() -> Iterator[list[FrameRef]]:
    """A black frame, a white one and some of noise, for as long as they are needed; the same every time."""
    draws = np.random.default_rng(0)
    noise = [draws.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(_NOISE)]
    with ScratchFolder() as folder:
        plain = [Image.new("RGB", (300, 300), colour) for colour in ("black", "white")]
        for number, picture in enumerate([*plain, *map(Image.fromarray, noise)]):
            picture.save(folder / f"{number}.png")
        yield frames_in_folder(folder)


def _row(ours: Policy, theirs: Policy, frames: Sequence[FrameRef], instruction: str) -> _ParityRow:
    differences, steps = [], (0, 0)
    for frame in frames:
        ours.reset()
        theirs.reset()
        pair = ours.act(frame, instruction), theirs.act(frame, instruction)
        steps = len(pair[0]), len(pair[1])
        differences.append(_difference(*pair))
    largest = np.max(differences, axis=0).tolist()
    return _ParityRow(instruction, len(frames), steps, *largest)


def _difference(ours: Sequence[ArmDelta], theirs: Sequence[ArmDelta]) -> list[float]:
    """Largest differences of translation, rotation and gripper; without end where one gave more steps."""
    if len(ours) != len(theirs):
        return [float("inf")] * 3
    apart = np.abs(_numbers(ours) - _numbers(theirs)).max(axis=0)
    return [apart[:3].max(), apart[3:6].max(), apart[6]]


def _numbers(steps: Sequence[ArmDelta]) -> np.ndarray:
    return np.array([(*step.translation, *step.rotation, step.gripper) for step in steps])


def _cells(row: _ParityRow) -> tuple[str, ...]:
    n_ours, n_theirs = row.n_steps
    steps = str(n_ours) if n_ours == n_theirs else f"{n_ours} and {n_theirs}"
    return (
        row.instruction,
        str(row.n_frames),
        steps,
        *(f"{x:.2g}" for x in (row.translation, row.rotation, row.gripper)),
    )
