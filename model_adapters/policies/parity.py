"""Comparison of a policy with another implementation of it behind a server."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef, find_images
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.tables import Column, Row, Table
from model_adapters.frame_policies import with_episodes
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.http.adapter import HttpPolicy
from model_adapters.protocols import ArmDelta, ArmObservation, Episode, FramePolicy, Policy
from model_adapters.refusals import check_chunk
from model_adapters.registry import has_option, load

INSTRUCTIONS = ("pick up the mug", "pick up the apple", "Put the knife in the drawer")
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
    """Differences between two implementations.

    Attributes:
        name: name of the policy.
        rows: largest differences of each instruction.
        tolerance: largest difference that counts as equal.
    """

    name: str
    rows: tuple[_ParityRow, ...]
    tolerance: float

    @property
    def equal(self) -> bool:
        """True if all actions agree."""
        return all(row.largest <= self.tolerance for row in self.rows)

    def table(self) -> Table:
        """Return a table of the largest differences, one row per instruction."""
        columns = ("instruction", "frames", "steps", "metres", "radians", "gripper")
        rows = tuple(Row(_cells(row)) for row in self.rows)
        verdict = "equal" if self.equal else "different"
        note = (
            f"Largest differences of actions; up to {self.tolerance:g} counts as equal: {verdict}."
        )
        title = f"{self.name} and its reference"
        return Table(
            title, tuple(Column(name, name != "instruction") for name in columns), rows, (note,)
        )


def load_policy(name: str, options: Mapping[str, str]) -> Policy | FramePolicy:
    """Load the policy to compare; chunks are not averaged unless the options say so."""
    defaults = {"ensemble": "none"} if has_option(name, "ensemble") else {}
    policy = load(name, {**defaults, **options}, seed=0)
    if not isinstance(policy, Policy | FramePolicy):
        policy.close()
        raise UsageError(f"{name} is not a policy; compare openvla or spatialvla")
    return policy


def reference_policy(url: str, unnorm_key: str | None) -> HttpPolicy:
    """Return the other implementation, a server with the `/act` convention, as a policy."""
    try:
        return HttpPolicy("reference", VlaHttpOptions(url=url, unnorm_key=unnorm_key))
    except ValueError as error:
        raise UsageError(f"--reference-url: {error}") from error


def compare_policies(
    ours: Policy | FramePolicy,
    theirs: Policy | FramePolicy,
    frames: Sequence[FrameRef],
    instructions: Sequence[str],
    tolerance: float,
) -> ParityReport:
    """Compare both's actions on the same frames and instructions, each the first of an episode."""
    both = with_episodes(ours), with_episodes(theirs)
    rows = tuple(_row(*both, frames, instruction) for instruction in instructions)
    return ParityReport(ours.name, rows, tolerance)


def frames_in_folder(folder: Path) -> list[FrameRef]:
    """Return the pictures of a folder, sorted by name."""
    paths = find_images(folder).values() if folder.is_dir() else ()
    if not paths:
        raise DataError(f"{folder}: has no pictures (PNG, JPEG, WebP); give a folder of frames")
    return [FrameRef(path) for path in paths]


@contextmanager
def synthetic_frames() -> Iterator[list[FrameRef]]:
    """Yield a black frame, a white one and some of noise, always the same, whose files exist within
    the context."""
    rng = np.random.default_rng(0)
    noise = [rng.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(_NOISE)]
    with ScratchFolder() as folder:
        plain = [Image.new("RGB", (300, 300), colour) for colour in ("black", "white")]
        for number, picture in enumerate([*plain, *map(Image.fromarray, noise)]):
            picture.save(folder / f"{number}.png")
        yield frames_in_folder(folder)


def _row(ours: Policy, theirs: Policy, frames: Sequence[FrameRef], instruction: str) -> _ParityRow:
    differences = []
    n_steps = (0, 0)
    for frame in frames:
        for policy in (ours, theirs):
            policy.begin(Episode("parity", instruction, 1))
        observation = ArmObservation(frame)
        pair = ours.act(observation), theirs.act(observation)
        for policy, chunk in zip((ours, theirs), pair, strict=True):
            check_chunk(policy.name, chunk)  # NaN would count as equal
        n_steps = len(pair[0]), len(pair[1])
        differences.append(_difference(*pair))
    largest = np.max(differences, axis=0).tolist()
    return _ParityRow(instruction, len(frames), n_steps, *largest)


def _difference(ours: Sequence[ArmDelta], theirs: Sequence[ArmDelta]) -> list[float]:
    """Return the largest differences of translation, rotation and gripper; infinite if the numbers
    of steps differ."""
    if len(ours) != len(theirs):
        return [float("inf")] * 3
    gaps = np.abs(_numbers(ours) - _numbers(theirs)).max(axis=0)
    return [gaps[:3].max(), gaps[3:6].max(), gaps[6]]


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
