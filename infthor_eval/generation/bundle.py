"""Building the question sets of the package reproducibly from a manifest of scenes and seeds.

The manifest has the trajectories to generate and how questions are sampled, or how twins are made
of them. The copy of it in the set also has digests of its files and trajectories, so that a test
can check that the same ones are built again.

A set is built in a hidden folder within the new one, and moved out of it when it is whole. A build
that was stopped goes on there with the trajectories that it had. Twins are copied without what
their questions do not need.
"""

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.table_writer import PackSettings
from infthor_eval.formats.packed.writing import CARD, pack_set
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.formats.step_log import LOG
from infthor_eval.formats.twins import ComparedFrame, TwinPair, read_pairs, write_pairs
from infthor_eval.generation.arm_twins.drafting import KIND as ARM_KIND
from infthor_eval.generation.compact.pictures import encode, encode_alike, reduce_colors
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.generate import GeneratedQuestions, generate_questions
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.twins.drafting import TwinSettings
from infthor_eval.generation.twins.twin_set import DraftTwins, TwinSummary, make_twins
from infthor_eval.generation.twins.undrawn import copy_questions, pack_worlds
from infthor_eval.grouping import grouped
from infthor_eval.storage.digests import digest_of_file, digest_of_files, fingerprint
from infthor_eval.storage.files import remove, write_atomically
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings

MANIFEST = "manifest.json"
_HINT = "give a manifest"
_NOT_SHIPPED = "replay.json"  # has wall times, which differ from build to build
_WORK = ".building-"  # of the hidden folder; the fingerprint of the manifest follows
# In the hidden folder: what is kept of a stopped build, and the set, which is made anew.
_TRAJECTORIES = "trajectories"
_REPLAYED = "replayed"
_WHOLE = "whole"
_SET = "set"
_TRAJECTORY = "traj_data.json"
_PACKED = PackSettings(level=19)
# All frames of a base are compressed together: its worlds differ little.
_PACKED_TWINS = PackSettings(frames_per_group=2_000, level=19)


class TrajectoryRecipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One trajectory: the arguments of `generate`."""

    scene: str
    seed: Annotated[int, Meta(ge=0)]
    min_steps: Annotated[int, Meta(ge=1)]
    min_subgoals: Annotated[int, Meta(ge=1)] = 1


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that determines a bundled set of questions.

    Attributes:
        name: name of the set; the question file is `qa_set_<name>.csv`.
        trajectories: trajectories to generate.
        per_trajectory: maximum number of questions on one trajectory.
        question_seed: seed of the choice of questions.
        further: True to include our further question forms.
        colors: number of colours in the palette of stored frames, which halves the size of the set.
        files: digests of files and trajectories by path; empty before the first build.
    """

    name: Annotated[str, Meta(pattern=r"^[\w.-]+$")]
    trajectories: Annotated[tuple[TrajectoryRecipe, ...], Meta(min_length=1)]
    per_trajectory: Annotated[int, Meta(ge=1)] = 25
    question_seed: int = 0
    further: bool = False
    colors: Annotated[int, Meta(ge=2, le=256)] = 128
    files: dict[str, str] = {}


class TwinsManifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that determines a bundled set of twins.

    Attributes:
        name: name of the set.
        trajectories: trajectories to generate, of which twins are made.
        twins: how twins are made; manifests of questions have no such field.
        per_trajectory: maximum number of paired questions on one trajectory.
        frames: False for the trajectories of the worlds in place of their frames.
        colors: number of colours of the pictures of one trajectory.
        files: digests of files and trajectories by path; empty before the first build.
    """

    name: Annotated[str, Meta(pattern=r"^[\w.-]+$")]
    trajectories: Annotated[tuple[TrajectoryRecipe, ...], Meta(min_length=1)]
    twins: TwinSettings
    per_trajectory: Annotated[int, Meta(ge=1)] = 25
    frames: bool = True
    colors: Annotated[int, Meta(ge=2, le=255)] = 64
    files: dict[str, str] = {}


class _AnyForm(msgspec.Struct):
    """What tells a manifest of twins."""

    twins: Any = None


_AnyManifest = TypeVar("_AnyManifest", Manifest, TwinsManifest)


def read_manifest(path: Path) -> Manifest | TwinsManifest:
    """Read a manifest, of questions or of twins."""
    is_of_twins = read_json(path, _HINT, _AnyForm).twins is not None
    if is_of_twins:
        return read_json(path, _HINT, TwinsManifest)
    return read_json(path, _HINT, Manifest)


def build_bundle(
    manifest: Manifest,
    simulator: Simulator,
    out: Path,
    advance: Callable[[bool], None] = lambda _: None,
) -> tuple[Manifest, GeneratedQuestions]:
    """Build the set: generate and replay trajectories, generate questions, compress the frames.

    Args:
        manifest: the manifest; its digests are not used.
        simulator: the embedded simulator.
        out: folder of the set: new, empty, or with a build that was stopped.
        advance: called twice for each trajectory, with True if it is of an earlier run.

    Returns:
        The manifest with the digests of the new files, and the questions.
    """
    with _building(manifest, out) as work:
        _generate(manifest, simulator, work / _TRAJECTORIES, advance)
        selection = select([work / _TRAJECTORIES])
        replayed = replay_set(selection, simulator, work / _REPLAYED, advance)
        _raise_first([failure.message for failure in replayed.failures])
        generated = generate_questions(
            work / _REPLAYED,
            seed=manifest.question_seed,
            per_trajectory=manifest.per_trajectory,
            further=manifest.further,
        )
        whole = work / _WHOLE
        shutil.copytree(work / _REPLAYED, whole, ignore=shutil.ignore_patterns(_NOT_SHIPPED))
        write_questions(whole / f"qa_set_{manifest.name}.csv", generated.questions)
        for frame in sorted(whole.rglob("img/*.png")):
            frame.write_bytes(encode(reduce_colors(FrameRef(frame).load(), manifest.colors)))
        return _pack(manifest, work), generated


def build_twins(
    manifest: TwinsManifest,
    draft: DraftTwins,
    out: Path,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
) -> tuple[TwinsManifest, TwinSummary]:
    """Build the set: generate trajectories, make twins of them, keep what their questions need.

    Args:
        manifest: the manifest; its digests are not used.
        draft: makes the twins of a trajectory.
        out: folder of the set: new, empty, or with a build that was stopped.
        worker_settings: number and place of the workers; they do not change the set.
        advance: called twice for each trajectory, with True if it is of an earlier run.

    Returns:
        The manifest with the digests of the new files, and the numbers of the set.
    """
    with _building(manifest, out) as work:
        with Simulator(embedded_launch(), image=False) as simulator:
            _generate(manifest, simulator, work / _TRAJECTORIES, advance)
        summary = make_twins(
            select([work / _TRAJECTORIES]),
            embedded_launch(),
            work / _REPLAYED,
            manifest.twins,
            draft,
            per_trajectory=manifest.per_trajectory,
            worker_settings=worker_settings,
            advance=advance,
        )
        _raise_first(summary.failures)
        whole = work / _WHOLE
        whole.mkdir()
        if manifest.frames:
            copy_compactly(work / _REPLAYED, whole, manifest.colors)
        else:
            pack_worlds(work / _REPLAYED, whole)
        return _pack(manifest, work), summary


def differing_files(
    expected: Manifest | TwinsManifest, built: Manifest | TwinsManifest
) -> list[str]:
    """Return the paths of files whose digests differ, or that only one of two manifests has."""
    names = expected.files.keys() | built.files.keys()
    return sorted(name for name in names if expected.files.get(name) != built.files.get(name))


@contextmanager
def _building(manifest: Manifest | TwinsManifest, out: Path) -> Iterator[Path]:
    """Yield the hidden folder of a build; what is in its `_SET` at the end is moved to `out`."""
    recipe = msgspec.to_builtins(msgspec.structs.replace(manifest, files={}))
    work = out / f"{_WORK}{fingerprint(recipe)}"
    out.mkdir(parents=True, exist_ok=True)
    whole = work / _SET
    if (whole / MANIFEST).is_file():  # stopped while the set was moved
        moved = read_json(whole / MANIFEST, _HINT, type(manifest)).files.keys()
        for name in {*moved, *CARD, *(path.name for path in out.glob("*.parquet"))}:
            remove(out / name)
    elif (out / MANIFEST).is_file():  # stopped after that, or not at all
        remove(work)
        raise DataError(f"{out}: has a whole set; give a new folder")
    if any(not path.name.startswith(".") for path in out.iterdir()):
        raise DataError(f"{out}: not empty; give a new folder")
    for other in out.glob(f"{_WORK}*"):
        if other != work:
            remove(other)
    remove(whole)
    remove(work / _WHOLE)
    work.mkdir(exist_ok=True)
    yield work
    for path in sorted(whole.iterdir(), key=lambda path: path.name == MANIFEST):  # that one last
        path.replace(out / path.name)
    remove(work)


def _generate(
    manifest: Manifest | TwinsManifest,
    simulator: Simulator,
    folder: Path,
    advance: Callable[[bool], None],
) -> None:
    recipes = manifest.trajectories
    jobs = [TrajectorySettings(**msgspec.structs.asdict(recipe)) for recipe in recipes]
    _raise_first(generate_set(jobs, simulator, folder, advance).failures)


def _pack(manifest: _AnyManifest, work: Path) -> _AnyManifest:
    """Pack a built set, write the manifest with the digests of its parts into it, return that."""
    out = work / _SET
    out.mkdir()
    settings = _PACKED_TWINS if isinstance(manifest, TwinsManifest) else _PACKED
    pack_set(NiehSet(work / _WHOLE), out, settings)
    finished = msgspec.structs.replace(manifest, files=digests_of(work / _WHOLE))
    content = msgspec.json.format(msgspec.json.encode(finished), indent=1)
    with write_atomically(out / MANIFEST) as partial:  # it says that all is there
        partial.write_bytes(content + b"\n")
    return finished


def _raise_first(failures: list[str]) -> None:
    if failures:
        raise DataError(f"the set cannot be built: {failures[0]}")


def digests_of(root: Path) -> dict[str, str]:
    """Return the digests of a set's files and trajectories; those of twins name their pictures."""
    files = [path for path in root.iterdir() if path.is_file() and path.name != MANIFEST]
    folders = list((root / "metadata").glob("*"))
    digests = {path.name: digest_of_file(path) for path in sorted(files)}
    for folder in sorted(folders):
        inside = sorted(path for path in folder.rglob("*") if path.is_file())
        digests[f"metadata/{folder.name}"] = digest_of_files(inside)
    return digests


def copy_compactly(source: Path, out: Path, colors: int) -> None:
    """Copy the worlds that questions are asked in: their logs, packed, and pictures.

    Left out are drafts, trajectories (`traj_data.json`) but those of arms, which act at their end,
    and actions and states in words.

    Args:
        source: a set of twins.
        out: folder of the copy, which exists and is empty.
        colors: number of colours of the pictures of one base trajectory.
    """
    data = NiehSet(source)
    pairs = read_pairs(source)
    names: dict[str, Sequence[str]] = {}
    for group in grouped((pair.base, pair) for pair in pairs).values():
        names.update(_copy_worlds(data, group, out, colors))
    write_pairs(out, [_compared(pair, names) for pair in pairs])
    copy_questions(source, out, data.files)


def _copy_worlds(
    data: NiehSet, pairs: Sequence[TwinPair], out: Path, colors: int
) -> Iterator[tuple[str, Sequence[str]]]:
    """Copy the worlds of one base trajectory, and yield the names of each one's pictures."""
    worlds: dict[str, Sequence[FrameRef]] = {
        name: data.frames(name) for pair in pairs for name in pair.traj_ids
    }
    pictures = encode_alike(chain.from_iterable(worlds.values()), colors)
    for name, frames in worlds.items():
        folder = out / "metadata" / name
        folder.mkdir(parents=True)
        stored = [store_picture(out, pictures[frame], name) for frame in frames]
        write_frame_names(folder, stored)
        for file in (LOG, _TRAJECTORY) if pairs[0].kind == ARM_KIND else (LOG,):
            (folder / file).write_bytes((data.folder(name) / file).read_bytes())
        yield name, stored


def _compared(pair: TwinPair, names: Mapping[str, Sequence[str]]) -> TwinPair:
    """Return a pair with what is equal now: fewer colours can make more pictures equal."""
    stored = zip(*(names[world] for world in pair.traj_ids), strict=True)
    frames = (
        ComparedFrame(first == second, frame.changed)
        for frame, (first, second) in zip(pair.frames, stored, strict=True)
    )
    return replace(pair, frames=tuple(frames))
