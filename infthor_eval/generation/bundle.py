"""Building the question sets of the package reproducibly from a manifest of scenes and seeds.

The manifest has the trajectories to generate and how questions are sampled. The copy of it in the
set also has the digest of every file, so that a test can check that the same files are built again.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.reading import read_json
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.generate import GeneratedQuestions, generate_questions
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.storage.digests import digest_of_file
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.simulator import Simulator

__all__ = [
    "MANIFEST",
    "Manifest",
    "TrajectoryRecipe",
    "build_bundle",
    "differing_files",
    "read_manifest",
]

MANIFEST = "manifest.json"
_NOT_SHIPPED = "replay.json"  # has wall times, which differ from build to build


class TrajectoryRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One trajectory: the arguments of `generate`."""

    scene: str
    seed: Annotated[int, Meta(ge=0)]
    min_steps: Annotated[int, Meta(ge=1)]
    min_subgoals: Annotated[int, Meta(ge=1)] = 1


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that determines a bundled set.

    Attributes:
        name: name of the set; the question file is `qa_set_<name>.csv`.
        trajectories: trajectories to generate.
        per_trajectory: maximum number of questions on one trajectory.
        question_seed: seed of the choice of questions.
        further: True to include our further question forms.
        colors: number of colours in the palette of stored frames, which halves the size of the set.
        files: digests of all files of the set by path; empty in a manifest before the first build.
    """

    name: Annotated[str, Meta(pattern=r"^[\w.-]+$")]
    trajectories: Annotated[tuple[TrajectoryRecipe, ...], Meta(min_length=1)]
    per_trajectory: Annotated[int, Meta(ge=1)] = 25
    question_seed: int = 0
    further: bool = False
    colors: Annotated[int, Meta(ge=2, le=256)] = 128
    files: dict[str, str] = {}


def read_manifest(path: Path) -> Manifest:
    """Read a manifest.

    Raises:
        DataError: the file cannot be read or is not a manifest.
    """
    return read_json(path, "give a manifest", Manifest)


def build_bundle(
    manifest: Manifest,
    simulator: Simulator,
    out: Path,
    progress: Callable[[bool], None] = lambda _: None,
) -> tuple[Manifest, GeneratedQuestions]:
    """Build the set: generate and replay trajectories, generate questions, compress the frames.

    Args:
        manifest: the manifest; its digests are not used.
        simulator: the embedded simulator.
        out: folder of the set, new or empty.
        progress: called twice for each trajectory, with True if it is of an earlier run.

    Returns:
        The manifest with the digests of the new files, and the questions.

    Raises:
        DataError: the folder is not empty, or a trajectory could not be generated or replayed.
    """
    if out.exists() and any(out.iterdir()):
        raise DataError(f"{out}: not empty; give a new folder")
    recipes = manifest.trajectories
    jobs = [TrajectorySettings(**msgspec.structs.asdict(recipe)) for recipe in recipes]
    with ScratchFolder() as folder:
        _raise_first(generate_set(jobs, simulator, folder, progress).failures)
        replayed = replay_set(select([folder]), simulator, out, progress)
    _raise_first([failure.message for failure in replayed.failures])
    generated = generate_questions(
        out,
        seed=manifest.question_seed,
        per_trajectory=manifest.per_trajectory,
        further=manifest.further,
    )
    write_questions(out / f"qa_set_{manifest.name}.csv", generated.questions)
    for frame in sorted(out.rglob("img/*.png")):
        _reduce_colors(frame, manifest.colors)
    for path in out.rglob(_NOT_SHIPPED):
        path.unlink()
    finished = msgspec.structs.replace(manifest, files=_digests(out))
    (out / MANIFEST).write_bytes(
        msgspec.json.format(msgspec.json.encode(finished), indent=1) + b"\n"
    )
    return finished, generated


def differing_files(expected: Manifest, built: Manifest) -> list[str]:
    """Return the paths of files whose digests differ, or that only one of two manifests has."""
    names = expected.files.keys() | built.files.keys()
    return sorted(name for name in names if expected.files.get(name) != built.files.get(name))


def _raise_first(failures: list[str]) -> None:
    if failures:
        raise DataError(f"the set cannot be built: {failures[0]}")


def _reduce_colors(path: Path, colors: int) -> None:
    with Image.open(path) as frame:
        reduced = frame.convert("RGB").quantize(colors, dither=Image.Dither.NONE)
    reduced.save(path, optimize=True)


def _digests(root: Path) -> dict[str, str]:
    files = sorted(path for path in root.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {str(path.relative_to(root)): digest_of_file(path) for path in files}
