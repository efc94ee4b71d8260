"""Question sets that come with the package, made from a manifest: scenes and seeds in, the same files out.

The manifest says which trajectories to generate and how questions are drawn; the set's own copy of it also has the
digest of every file, by which a test tells that the same set comes out again.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.digests import digest_of_file
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.generate import GeneratedQuestions, generate_questions
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.thor.simulator import Simulator

__all__ = ["MANIFEST", "Manifest", "TrajectoryRecipe", "build_bundle", "differing_files", "read_manifest"]

MANIFEST = "manifest.json"
_NOT_SHIPPED = ("replay.json",)  # holds times


class TrajectoryRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One trajectory: the arguments of `generate`."""

    scene: str
    seed: Annotated[int, Meta(ge=0)]
    min_steps: Annotated[int, Meta(ge=1)]
    min_subgoals: Annotated[int, Meta(ge=1)] = 1


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a bundled set is made from.

    Attributes:
        name: of the set; the question file is `qa_set_<name>.csv`.
        trajectories: what to generate.
        per_trajectory: questions at most on one trajectory.
        question_seed: makes every choice among the questions.
        further: whether questions of our further forms are asked too.
        colors: frames are stored with a palette of so many colours, which halves the set.
        files: digest by path of every file of the set; empty in a manifest that nothing was made from yet.
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
        DataError: it cannot be read or is none.
    """
    return read_json(path, "give a manifest", Manifest)


def build_bundle(
    manifest: Manifest, simulator: Simulator, out: Path, progress: Callable[[bool], None] = lambda _: None
) -> tuple[Manifest, GeneratedQuestions]:
    """Make the set: generate, replay, ask, and store the frames small.

    Args:
        manifest: what to make; its digests are not looked at.
        simulator: the embedded one.
        out: folder of the set; must not exist or be empty.
        progress: is called twice for each trajectory, with whether an earlier run had made it.

    Returns:
        The manifest with the digests of what was made, and the questions.

    Raises:
        DataError: the folder is not empty, or a trajectory could not be made.
    """
    if out.exists() and any(out.iterdir()):
        raise DataError(f"{out}: is not empty; give a new folder")
    jobs = [TrajectorySettings(**msgspec.structs.asdict(item)) for item in manifest.trajectories]
    with ScratchFolder() as folder:
        _refuse(generate_set(jobs, simulator, folder, progress).failures)
        replayed = replay_set(select([folder]), simulator, out, progress)
    _refuse([f"{item.place}: {item.message}" for item in replayed.failures])
    made = generate_questions(
        out, seed=manifest.question_seed, per_trajectory=manifest.per_trajectory, further=manifest.further
    )
    write_questions(out / f"qa_set_{manifest.name}.csv", made.questions)
    for frame in sorted(out.rglob("img/*.png")):
        _store_small(frame, manifest.colors)
    for name in _NOT_SHIPPED:
        for path in out.rglob(name):
            path.unlink()
    finished = msgspec.structs.replace(manifest, files=_digests(out))
    (out / MANIFEST).write_bytes(msgspec.json.format(msgspec.json.encode(finished), indent=1) + b"\n")
    return finished, made


def differing_files(wanted: Manifest, made: Manifest) -> list[str]:
    """Paths of the files whose digests differ, or that one of two manifests lacks."""
    names = wanted.files.keys() | made.files.keys()
    return sorted(name for name in names if wanted.files.get(name) != made.files.get(name))


def _refuse(failures: list[str]) -> None:
    if failures:
        raise DataError(f"the set cannot be made: {failures[0]}")


def _store_small(path: Path, colors: int) -> None:
    with Image.open(path) as frame:
        small = frame.convert("RGB").quantize(colors, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def _digests(root: Path) -> dict[str, str]:
    files = sorted(path for path in root.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {str(path.relative_to(root)): digest_of_file(path) for path in files}
