"""Replaying many trajectories into one set; an interrupted run is resumed by the same command.

Each trajectory is written to a hidden folder, which is renamed when it is complete. An existing
folder is therefore complete; if it was made from the same trajectory, it is counted and not
replayed again.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import msgspec

from infthor_eval.errors import DataError, InfthorError, SimulatorError, wrap_errors
from infthor_eval.formats.reading import read_json
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.formats.trajectory import (
    Trajectory,
    TrajectorySource,
    iter_sources,
    trajectory_files,
)
from infthor_eval.generation.replay import ReplayReport, SetForm
from infthor_eval.generation.simulator_jobs import (
    OnProgress,
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
    ignore_progress,
)
from infthor_eval.storage.files import file_name, is_written, write_atomically, writing_hint
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import agent_path
from infthor_eval.workers import WorkerSettings, run_jobs

_REPORT = "replay.json"
_SET = SetForm()
Item = tuple[TrajectorySource, Trajectory]


class ReplayForm(Protocol):
    """What is written of a replay; it is pickled for workers."""

    @property
    def folder(self) -> str:
        """Folder of the trajectories' folders, in that of the set."""

    @property
    def simulator_options(self) -> Mapping[str, Any]:
        """Options of the `Simulator` that renders it."""

    @property
    def report_type(self) -> type[ReplayReport]:
        """Type of its reports (`replay.json`)."""

    def write(
        self,
        source: TrajectorySource,
        trajectory: Trajectory,
        simulator: Simulator,
        folder: Path,
        on_progress: OnProgress = ignore_progress,
    ) -> ReplayReport:
        """Replay a trajectory into an existing, empty folder; see `replay`."""

    def require_same(self, report: Any, folder: Path) -> None:
        """Raise DataError if the report in a folder, of `report_type`, has other settings."""


@dataclass(frozen=True)
class ReplayFailure:
    """A trajectory that could not be replayed at all.

    Attributes:
        place: its file and line.
        message: the reason in one line, which names the place too.
    """

    place: str
    message: str


@dataclass
class Selection:
    """The trajectories to replay, and those that could not be read."""

    items: list[Item] = field(default_factory=list)
    failures: list[ReplayFailure] = field(default_factory=list)


@dataclass
class ReplayedSet:
    """A set of replayed trajectories.

    Attributes:
        reports: reports of the replayed trajectories, including those of earlier runs.
        resumed: number of trajectories that earlier runs replayed.
        failures: trajectories that could not be replayed.
        seconds: wall time of this run.
    """

    reports: list[ReplayReport] = field(default_factory=list)
    resumed: int = 0
    failures: list[ReplayFailure] = field(default_factory=list)
    seconds: float = 0.0


def select(
    paths: Iterable[Path], limit: int | None = None, per_floor_plan: int | None = None
) -> Selection:
    """Read trajectories of files and folders, at most `limit`, and `per_floor_plan` on one plan."""
    selection = Selection()
    taken: Counter[str] = Counter()
    for source in _all_sources(paths, selection.failures):
        if limit is not None and len(selection.items) >= limit:
            break
        try:
            trajectory = source.read()
            with wrap_malformed(f"{source.place}: "):
                # Read for all scenes before the first replay, so an error must show here.
                agent_path(trajectory)
        except DataError as error:
            selection.failures.append(ReplayFailure(source.place, str(error)))
            continue
        floor_plan = trajectory.scene.floor_plan
        if per_floor_plan is None or taken[floor_plan] < per_floor_plan:
            taken[floor_plan] += 1
            selection.items.append((source, trajectory))
    return selection


@dataclass(frozen=True)
class _ReplayOutcome:
    """The outcome of one trajectory.

    Attributes:
        report: report of its replay; None if it could not be replayed.
        is_resumed: True if an earlier run replayed it.
        failure: reason why there is no report.
    """

    report: ReplayReport | None = None
    is_resumed: bool = False
    failure: ReplayFailure | None = None


def replay_set(
    selection: Selection,
    simulator: Simulator,
    out: Path,
    advance: Callable[[bool], None] = lambda _: None,
    form: ReplayForm = _SET,
) -> ReplayedSet:
    """Replay trajectories into folders, those of a set into `out/metadata/<traj_id>`.

    A failure does not stop the others.

    Args:
        selection: the trajectories.
        simulator: simulator to replay them in.
        out: folder of the set; created if it does not exist.
        advance: called after each trajectory, with True if an earlier run replayed it.
        form: what is written of each.
    """
    folder = _prepare_set(out, simulator.label, simulator.frames, form)
    outcomes = enumerate(_replay_one(item, simulator, folder, form) for item in selection.items)
    return _collect(outcomes, selection, advance)


def replay_with_workers(
    selection: Selection,
    launch: Launch,
    out: Path,
    worker_settings: WorkerSettings,
    form: ReplayForm = _SET,
    advance: Callable[[bool], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
    on_progress: OnProgress = ignore_progress,
) -> ReplayedSet:
    """Replay as `replay_set` does, with the same files, by workers that share the folder.

    Args:
        selection: the trajectories.
        launch: simulator that each worker starts.
        out: see `replay_set`.
        worker_settings: number and place of the workers.
        form: see `replay_set`.
        advance: see `replay_set`.
        notify: called with messages about the workers.
        on_progress: called within a trajectory, if this process is the worker.
    """
    shown = on_progress if worker_settings.is_local else ignore_progress
    folder = _prepare_set(out, launch.label, launch.frames, form)
    replay_one = partial(_replay_one, out=folder, form=form, on_progress=shown)
    open_simulator = partial(Simulator, launch, **form.simulator_options)
    start = partial(SimulatorWorker, open_simulator, replay_one)
    return _collect(run_jobs(start, selection.items, worker_settings, notify), selection, advance)


def _prepare_set(out: Path, label: str, frames: int | None, form: ReplayForm) -> Path:
    """Create the folder of the trajectories' folders."""
    folder = out / form.folder
    folder.mkdir(parents=True, exist_ok=True)
    claim_for_simulator(out, label, frames)
    return folder


def _collect(
    outcomes: Iterable[tuple[int, _ReplayOutcome | InfthorError]],
    selection: Selection,
    advance: Callable[[bool], None],
) -> ReplayedSet:
    """Return the set of the outcomes, in the order of the selection."""
    started = time.monotonic()

    def failed(number: int, error: InfthorError) -> _ReplayOutcome:
        return _failure_outcome(selection.items[number], error)

    collected = collect_outcomes(outcomes, failed, advance)
    result = ReplayedSet(failures=list(selection.failures), seconds=time.monotonic() - started)
    for outcome in collected:
        if outcome.report is not None:
            result.reports.append(outcome.report)
            result.resumed += outcome.is_resumed
        elif outcome.failure is not None:
            result.failures.append(outcome.failure)
    return result


def _replay_one(
    item: Item,
    simulator: Simulator,
    out: Path,
    form: ReplayForm,
    on_progress: OnProgress = ignore_progress,
) -> _ReplayOutcome:
    source, trajectory = item
    try:
        with freeze_existing_objects(), wrap_malformed():
            return _replay_or_check(source, trajectory, simulator, out, form, on_progress)
    except InfthorError as error:
        return _failure_outcome(item, error)


def _failure_outcome(item: Item, error: InfthorError) -> _ReplayOutcome:
    source, trajectory = item
    return _ReplayOutcome(
        failure=ReplayFailure(source.place, f"{source.place}: {trajectory.traj_id}: {error}")
    )


def _all_sources(
    paths: Iterable[Path], failures: list[ReplayFailure]
) -> Iterator[TrajectorySource]:
    """Yield the trajectories of all files; one of several that cannot be read is in `failures`."""
    for path in paths:
        files = trajectory_files(path)
        for file in files:
            n_read = 0
            try:
                for source in iter_sources(file):
                    n_read += 1
                    yield source
            except DataError as error:
                if not n_read and files == [path]:
                    raise
                failures.append(ReplayFailure(str(file), str(error)))


def wrap_malformed(place: str = "") -> AbstractContextManager[None]:
    """Convert the errors of a trajectory that has the documented form but inconsistent content."""
    wrong = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
    return wrap_errors(
        f"{place}not a trajectory that can be replayed", "restore it or leave it out", catch=wrong
    )


def _replay_or_check(
    source: TrajectorySource,
    trajectory: Trajectory,
    simulator: Simulator,
    out: Path,
    form: ReplayForm,
    on_progress: OnProgress,
) -> _ReplayOutcome:
    final = out / file_name(trajectory.traj_id)
    if is_written(final):
        return _ReplayOutcome(_check_earlier(final, source.digest, form), is_resumed=True)
    started = time.monotonic()
    hint = writing_hint(", or choose another --out")
    with (
        wrap_errors(f"{final}: cannot be written", hint, raise_as=SimulatorError),
        write_atomically(final) as folder,
    ):
        folder.mkdir()
        report = form.write(source, trajectory, simulator, folder, on_progress)
        report.seconds = round(time.monotonic() - started, 3)
        (folder / _REPORT).write_bytes(msgspec.json.encode(report) + b"\n")
    return _ReplayOutcome(report)


def _check_earlier(folder: Path, digest: str, form: ReplayForm) -> ReplayReport:
    """Return the report of an earlier run, if it is of the same trajectory and settings."""
    hint = "remove the folder to replay it again"
    report = read_json(folder / _REPORT, hint, form.report_type)
    if report.digest != digest:
        raise DataError(
            f"{folder}: replayed from another trajectory of this name; remove it or choose another "
            "--out"
        )
    form.require_same(report, folder)
    return report
