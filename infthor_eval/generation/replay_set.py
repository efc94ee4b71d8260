"""Replaying many trajectories into one set, so that stopping and starting continues.

Each trajectory is made in a hidden folder beside its final place and moved there when it is complete; what is
there is complete. A folder that is there already, made from the same trajectory, is counted and not made
again.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, InfthorError, SimulatorError, wrap_errors
from infthor_eval.formats.digests import digest
from infthor_eval.formats.files import write_atomically
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource, folder_name, iter_sources, trajectory_files
from infthor_eval.generation.garbage import freeze_existing_objects
from infthor_eval.generation.replay import ReplayReport, replay
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import agent_path
from infthor_eval.workers import WorkerSettings, shared_out

__all__ = ["ReplayFailure", "ReplayedSet", "Selection", "replay_set", "replay_with_workers", "select"]

_REPORT = "replay.json"
_TRAJECTORY = "traj_data.json"


@dataclass(frozen=True)
class ReplayFailure:
    """A trajectory that could not be replayed at all."""

    place: str
    message: str


@dataclass
class Selection:
    """The trajectories to replay, and those that could not even be read."""

    items: list[tuple[TrajectorySource, Trajectory]] = field(default_factory=list)
    failures: list[ReplayFailure] = field(default_factory=list)


@dataclass
class ReplayedSet:
    """What came of a set.

    Attributes:
        reports: one per replayed trajectory, those of earlier runs included.
        resumed: how many of them are from earlier runs.
        failures: the trajectories without one.
        seconds: wall time of this run.
    """

    reports: list[ReplayReport] = field(default_factory=list)
    resumed: int = 0
    failures: list[ReplayFailure] = field(default_factory=list)
    seconds: float = 0.0


def select(paths: Iterable[Path], limit: int | None = None, per_floor_plan: int | None = None) -> Selection:
    """Read the trajectories to replay.

    Args:
        paths: files and directories.
        limit: take no more than this many.
        per_floor_plan: take no more than this many of one floor plan.

    Raises:
        DataError: a path holds no trajectory file.
    """
    selection = Selection()
    taken: Counter[str] = Counter()
    for source in _all_sources(paths, selection.failures):
        if limit is not None and len(selection.items) >= limit:
            break
        try:
            trajectory = source.read()
            with _malformed(source):
                agent_path(trajectory)  # what the scene is supplemented with, before the first replay
        except DataError as error:
            selection.failures.append(ReplayFailure(source.place, str(error)))
            continue
        floor_plan = trajectory.scene.floor_plan
        if per_floor_plan is None or taken[floor_plan] < per_floor_plan:
            taken[floor_plan] += 1
            selection.items.append((source, trajectory))
    return selection


Item = tuple[TrajectorySource, Trajectory]


@dataclass(frozen=True)
class _ReplayOutcome:
    """What became of one trajectory.

    Attributes:
        report: of its replay; None where it could not be replayed at all.
        new: whether it was made now.
        failure: why there is no report.
    """

    report: ReplayReport | None = None
    new: bool = False
    failure: ReplayFailure | None = None


def replay_set(
    selection: Selection,
    simulator: Simulator,
    out: Path,
    progress: Callable[[bool], None] = lambda _: None,
    frames: int = 1,
) -> ReplayedSet:
    """Replays the selected trajectories into `out/metadata/<traj_id>`.

    Args:
        selection: what to replay.
        simulator: runs them.
        out: the set; made where it does not exist.
        progress: is called after each trajectory, with whether an earlier run had made it.
        frames: per action that moves the agent or its camera.

    Returns:
        The result. The failure of one trajectory is in it and does not stop the others.
    """
    metadata = _prepared(out, simulator.label)
    outcomes = enumerate(_outcome(item, simulator, metadata, frames) for item in selection.items)
    return _collected(outcomes, selection, progress)


def replay_with_workers(
    selection: Selection,
    launch: Launch,
    out: Path,
    worker_settings: WorkerSettings,
    frames: int = 1,
    progress: Callable[[bool], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> ReplayedSet:
    """As `replay_set`, by workers with a simulator each: the same files.

    Args:
        selection: what to replay.
        launch: how a simulator is started.
        out: the set, the same for all workers; made where it does not exist.
        worker_settings: how many workers, and where.
        frames: per action that moves the agent or its camera.
        progress: is called after each trajectory, with whether an earlier run had made it.
        say: is told what becomes of workers.
    """
    metadata = _prepared(out, launch.label)
    outcomes = shared_out(_OpenReplayer(launch, metadata, frames), selection.items, worker_settings, say)
    return _collected(outcomes, selection, progress)


@dataclass(frozen=True)
class _OpenReplayer:
    """Makes a worker that replays."""

    launch: Launch
    metadata: Path
    frames: int

    def __call__(self, number: int) -> "_Replayer":
        return _Replayer(self)


class _Replayer:
    """Replays in a simulator of its own; see `infthor_eval.workers.Worker`."""

    greeting = None

    def __init__(self, settings: _OpenReplayer) -> None:
        self._settings = settings
        self._simulator = Simulator(settings.launch)

    def do(self, job: Item) -> Iterator[_ReplayOutcome]:
        yield _outcome(job, self._simulator, self._settings.metadata, self._settings.frames)

    def close(self) -> None:
        self._simulator.close()


def _prepared(out: Path, label: str) -> Path:
    """The folder that takes the trajectories of a set."""
    metadata = out / "metadata"
    metadata.mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, label)
    return metadata


def _collected(
    outcomes: Iterable[tuple[int, _ReplayOutcome | InfthorError]],
    selection: Selection,
    progress: Callable[[bool], None],
) -> ReplayedSet:
    """What came of it, in the order of the selection."""
    started = time.monotonic()
    found: dict[int, _ReplayOutcome] = {}
    for number, outcome in outcomes:
        if isinstance(outcome, InfthorError):
            outcome = _failed(selection.items[number], outcome)  # noqa: PLW2901
        found[number] = outcome
        progress(outcome.report is not None and not outcome.new)
    result = ReplayedSet(failures=list(selection.failures), seconds=time.monotonic() - started)
    for _, outcome in sorted(found.items()):
        if outcome.report is not None:
            result.reports.append(outcome.report)
            result.resumed += not outcome.new
        elif outcome.failure is not None:
            result.failures.append(outcome.failure)
    return result


def _outcome(item: Item, simulator: Simulator, metadata: Path, frames: int) -> _ReplayOutcome:
    source, trajectory = item
    try:
        with freeze_existing_objects(), _malformed(source):
            return _ReplayOutcome(*_one(source, trajectory, simulator, metadata, frames))
    except InfthorError as error:
        return _failed(item, error)


def _failed(item: Item, error: InfthorError) -> _ReplayOutcome:
    source, trajectory = item
    return _ReplayOutcome(failure=ReplayFailure(source.place, f"{trajectory.traj_id}: {error}"))


def _all_sources(paths: Iterable[Path], failures: list[ReplayFailure]) -> Iterator[TrajectorySource]:
    """What is in the files; one of several that cannot be read to its end is a failure, and the others go on."""
    for path in paths:
        files = trajectory_files(path)
        for file in files:
            n_found = 0
            try:
                for source in iter_sources(file):
                    n_found += 1
                    yield source
            except DataError as error:
                if not n_found and files == [path]:
                    raise
                failures.append(ReplayFailure(str(file), str(error)))


def _malformed(source: TrajectorySource) -> AbstractContextManager[None]:
    """Names what a trajectory that is JSON of the right form can still be wrong in."""
    wrong = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
    return wrap_errors(
        f"{source.place}: not a trajectory that can be replayed", "restore it or leave it out", catch=wrong
    )


def _one(
    source: TrajectorySource, trajectory: Trajectory, simulator: Simulator, metadata: Path, frames: int
) -> tuple[ReplayReport, bool]:
    """The report of one trajectory, and whether it was made now."""
    content = source.raw.strip()
    final = metadata / folder_name(trajectory.traj_id)
    if final.exists():
        return _earlier(final, digest(content), frames), False
    started = time.monotonic()
    try:
        with write_atomically(final) as partial:
            partial.mkdir()
            report = replay(trajectory, simulator, partial, digest(content), frames)
            report.seconds = round(time.monotonic() - started, 3)
            (partial / _TRAJECTORY).write_bytes(content + b"\n")
            (partial / _REPORT).write_bytes(msgspec.json.encode(report) + b"\n")
    except OSError as error:
        message = f"{final}: cannot be written ({error.strerror}); make room or choose another --out"
        raise SimulatorError(message) from error
    return report, True


def _earlier(folder: Path, wanted: str, frames: int) -> ReplayReport:
    """The report of a trajectory that an earlier run replayed."""
    path = folder / _REPORT
    report = read_json(path, "remove the folder to replay it again", ReplayReport)
    if report.digest != wanted:
        raise DataError(f"{folder}: made from another trajectory of this name; remove it or choose another --out")
    if report.frames != frames:
        raise DataError(f"{folder}: made with {report.frames} frames per move; remove it or choose another --out")
    return report
