"""Generating many trajectories into a directory, so that stopping and starting continues."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.errors import InfthorError, UsageError, wrap_errors
from infthor_eval.formats.files import write_atomically
from infthor_eval.formats.trajectory import encode_trajectory, iter_sources
from infthor_eval.generation.factory import GeneratedTrajectory, TaskStatistics, generate
from infthor_eval.generation.garbage import freeze_existing_objects
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.pddl import DOMAIN
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, shared_out

__all__ = ["GeneratedSet", "GenerationSummary", "TaskCounts", "generate_set", "generate_with_workers"]


class TaskCounts(msgspec.Struct):
    """Numbers of tasks of one type."""

    tried: int
    accepted: int


class GenerationSummary(msgspec.Struct):
    """What came of it in numbers, as `--json` prints it.

    Attributes:
        trajectories: how many there are.
        resumed: how many of them are from earlier runs.
        steps: low-level actions of all of them.
        tasks: numbers of this run, by task type.
        refusals: why tasks failed in this run, the most frequent first.
        failures: what could not be made, one line each.
    """

    trajectories: int
    resumed: int
    steps: int
    tasks: dict[str, TaskCounts]
    refusals: dict[str, int]
    failures: list[str]


@dataclass
class GeneratedSet:
    """What came of it.

    Attributes:
        paths: the trajectories, those of earlier runs included.
        resumed: how many of them are from earlier runs.
        steps: low-level actions of all of them.
        failures: what could not be made, one line each.
        statistics: tasks tried and accepted in this run.
    """

    paths: list[Path] = field(default_factory=list)
    resumed: int = 0
    steps: int = 0
    failures: list[str] = field(default_factory=list)
    statistics: TaskStatistics = field(default_factory=TaskStatistics)

    def summary(self) -> GenerationSummary:
        """It in numbers."""
        tried, accepted = self.statistics.tried, self.statistics.accepted
        return GenerationSummary(
            trajectories=len(self.paths),
            resumed=self.resumed,
            steps=self.steps,
            tasks={name: TaskCounts(tried[name], accepted[name]) for name in sorted(tried)},
            refusals=dict(self.statistics.reasons.most_common()),
            failures=self.failures,
        )


@dataclass(frozen=True)
class _GenerationOutcome:
    """What became of one job.

    Attributes:
        path: of the trajectory; None where it could not be made.
        steps: its low-level actions.
        statistics: tasks tried and accepted; None where an earlier run made it.
        failure: why it could not be made.
    """

    path: Path | None = None
    steps: int = 0
    statistics: TaskStatistics | None = None
    failure: str | None = None


def generate_set(
    jobs: Sequence[TrajectorySettings],
    simulator: Simulator,
    out: Path,
    progress: Callable[[bool], None] = lambda _: None,
) -> GeneratedSet:
    """Make the trajectories that `out` does not have yet, one file each, and beside it their tasks as PDDL.

    Args:
        jobs: what to make.
        simulator: where it happens.
        out: directory of the files; made where it does not exist.
        progress: is called after each trajectory, with whether an earlier run had made it.

    Raises:
        DataError: a trajectory cannot be written; those before it stay.
    """
    out.mkdir(parents=True, exist_ok=True)
    return _collected(enumerate(_outcome(job, simulator, out) for job in jobs), progress)


def generate_with_workers(
    jobs: Sequence[TrajectorySettings],
    launch: Launch,
    out: Path,
    worker_settings: WorkerSettings,
    progress: Callable[[bool], None] = lambda _: None,
    say: Callable[[str], None] = lambda _: None,
) -> GeneratedSet:
    """As `generate_set`, by workers with a simulator each: the same files.

    Args:
        jobs: what to make.
        launch: how a simulator is started.
        out: directory of the files, the same for all workers; made where it does not exist.
        worker_settings: how many workers, and where.
        progress: is called after each trajectory, with whether an earlier run had made it.
        say: is told what becomes of workers.

    Raises:
        DataError: a trajectory cannot be written; those before it stay.
    """
    out.mkdir(parents=True, exist_ok=True)
    return _collected(shared_out(_OpenMaker(launch, out), jobs, worker_settings, say), progress)


@dataclass(frozen=True)
class _OpenMaker:
    """Makes a worker that generates."""

    launch: Launch
    out: Path

    def __call__(self, number: int) -> "_Maker":
        return _Maker(self.launch, self.out)


class _Maker:
    """Generates in a simulator of its own; see `infthor_eval.workers.Worker`."""

    greeting = None

    def __init__(self, launch: Launch, out: Path) -> None:
        self._simulator = Simulator(launch)
        self._out = out

    def do(self, job: TrajectorySettings) -> Iterator[_GenerationOutcome]:
        yield _outcome(job, self._simulator, self._out)

    def close(self) -> None:
        self._simulator.close()


def _collected(
    outcomes: Iterable[tuple[int, _GenerationOutcome | InfthorError]], progress: Callable[[bool], None]
) -> GeneratedSet:
    """What came of it, in the order of the jobs."""
    found: dict[int, _GenerationOutcome] = {}
    for number, outcome in outcomes:
        if isinstance(outcome, InfthorError):
            outcome = _GenerationOutcome(failure=str(outcome))  # noqa: PLW2901
        found[number] = outcome
        progress(outcome.path is not None and outcome.statistics is None)
    result = GeneratedSet()
    for _, outcome in sorted(found.items()):
        if outcome.path is None:
            result.failures.append(str(outcome.failure))
            continue
        result.paths.append(outcome.path)
        result.steps += outcome.steps
        if outcome.statistics is None:
            result.resumed += 1
        else:
            result.statistics.add(outcome.statistics)
    return result


def _outcome(job: TrajectorySettings, simulator: Simulator, out: Path) -> _GenerationOutcome:
    path = out / f"{job.traj_id}.json"
    try:
        if path.exists():
            return _GenerationOutcome(path, _earlier(path, job))
        made = _made(job, simulator)
    except InfthorError as error:
        return _GenerationOutcome(failure=str(error))
    _write(made, path)  # not a failure of this one: where it has no room, the others would be made in vain
    return _GenerationOutcome(path, len(made.trajectory.plan.low_actions), made.statistics)


def _made(job: TrajectorySettings, simulator: Simulator) -> GeneratedTrajectory:
    with freeze_existing_objects():
        return generate(job, simulator)


def _write(made: GeneratedTrajectory, path: Path) -> None:
    folder = path.with_suffix(".pddl")
    with wrap_errors(
        f"{path}: cannot be written", "make room and run the same command again, which goes on where it was"
    ):
        folder.mkdir(exist_ok=True)
        (folder / "domain.pddl").write_text(DOMAIN)
        for number, problem in enumerate(made.problems):
            (folder / f"task-{number:03d}.pddl").write_text(problem)
        with write_atomically(path) as partial:  # it comes last: where it is, everything is
            partial.write_bytes(encode_trajectory(made.trajectory))


def _earlier(path: Path, job: TrajectorySettings) -> int:
    trajectory = next(iter_sources(path)).read()
    made = trajectory.gen_info or {}
    if made.get("settings") != job.document():
        raise UsageError(f"{path}: made with other settings; remove it or choose another --out")
    return len(trajectory.plan.low_actions)
