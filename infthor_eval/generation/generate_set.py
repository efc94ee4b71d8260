"""Generating many trajectories into a folder; an interrupted run is resumed by the same command."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.errors import InfthorError, UsageError, wrap_errors
from infthor_eval.formats.trajectory import Trajectory, encode_trajectory, iter_sources
from infthor_eval.generation.factory import GeneratedTrajectory, generate
from infthor_eval.generation.final_task import violation
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.simulator_jobs import (
    OnProgress,
    SimulatorWorker,
    collect_outcomes,
    freeze_existing_objects,
    ignore_progress,
)
from infthor_eval.generation.statistics import AttemptStatistics
from infthor_eval.household.pddl import DOMAIN
from infthor_eval.storage.files import file_name, is_written, write_atomically, writing_hint
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings, run_jobs

_MAX_COPIES = 16  # of the simulator's state


class TaskCounts(msgspec.Struct):
    """Numbers of tasks of one type."""

    tried: int
    accepted: int


class GenerationSummary(msgspec.Struct):
    """Numbers of a set of trajectories, as `--json` prints them.

    Attributes:
        trajectories: number of trajectories.
        resumed: number of trajectories of earlier runs.
        steps: number of low-level actions in all trajectories.
        tasks: numbers of tasks in this run, by task type.
        refusals: numbers of failed tasks in this run by reason, the most frequent first.
        not_executed: numbers of sampled tasks in this run of which nothing was executed, by reason.
        roll_backs: sub-goals dropped at dead ends in this run, as text: "1 sub-goal at step 215,
            back to 203".
        pool_restarts: how often in this run all tasks had been drawn, and were drawn again.
        kept: number of trajectories in this run that gave up, and were kept as far as they got.
        final_tasks: by trajectory with a final task, whether that needs a memory: one object was
            seen in the first fifth of the steps alone, the other in the last alone.
        failures: trajectories that could not be generated, one line each.
    """

    trajectories: int
    resumed: int
    steps: int
    tasks: dict[str, TaskCounts]
    refusals: dict[str, int]
    not_executed: dict[str, int]
    roll_backs: list[str]
    pool_restarts: int
    kept: int
    final_tasks: dict[str, bool]
    failures: list[str]


@dataclass
class GeneratedSet:
    """A set of generated trajectories.

    Attributes:
        paths: files of the trajectories, including those of earlier runs.
        resumed: number of trajectories of earlier runs.
        steps: number of low-level actions in all trajectories.
        failures: trajectories that could not be generated, one line each.
        kept: number of trajectories in this run that gave up, and were kept as far as they got.
        final_tasks: by trajectory with a final task, whether that needs a memory.
        statistics: tasks tried and accepted in this run.
    """

    paths: list[Path] = field(default_factory=list)
    resumed: int = 0
    steps: int = 0
    failures: list[str] = field(default_factory=list)
    kept: int = 0
    final_tasks: dict[str, bool] = field(default_factory=dict)
    statistics: AttemptStatistics = field(default_factory=AttemptStatistics)

    def summary(self) -> GenerationSummary:
        """Return the numbers of the set."""
        statistics = self.statistics
        tried = statistics.tried
        accepted = statistics.accepted
        return GenerationSummary(
            trajectories=len(self.paths),
            resumed=self.resumed,
            steps=self.steps,
            tasks={name: TaskCounts(tried[name], accepted[name]) for name in sorted(tried)},
            refusals=dict(statistics.reasons.most_common()),
            not_executed=dict(statistics.not_executed.most_common()),
            roll_backs=list(map(str, statistics.roll_backs)),
            pool_restarts=len(statistics.pool_restarts),
            kept=self.kept,
            final_tasks=self.final_tasks,
            failures=self.failures,
        )


@dataclass(frozen=True)
class _GenerationOutcome:
    """The outcome of one job.

    Attributes:
        path: file of the trajectory; None if it could not be generated.
        steps: number of low-level actions.
        statistics: tasks tried and accepted; None for a trajectory of an earlier run.
        needs_memory: whether its final task does; None if it has none.
        failure: reason why it could not be generated.
    """

    path: Path | None = None
    steps: int = 0
    statistics: AttemptStatistics | None = None
    needs_memory: bool | None = None
    failure: str | None = None

    @classmethod
    def of(
        cls, path: Path, trajectory: Trajectory, statistics: AttemptStatistics | None = None
    ) -> "_GenerationOutcome":
        """Return the outcome of a job whose trajectory is there."""
        has_final = trajectory.long_horizon_task is not None
        memory = violation(trajectory, alone=True) is None if has_final else None
        return cls(path, len(trajectory.plan.low_actions), statistics, memory)

    @property
    def is_resumed(self) -> bool:
        """True for a trajectory of an earlier run."""
        return self.path is not None and self.statistics is None


def generate_set(
    jobs: Sequence[TrajectorySettings],
    simulator: Simulator,
    out: Path,
    advance: Callable[[bool], None] = lambda _: None,
) -> GeneratedSet:
    """Generate the trajectories that `out` lacks: a file each, with a folder of its tasks as PDDL.

    Args:
        jobs: settings of the trajectories.
        simulator: simulator to generate them in.
        out: folder of the files; created if it does not exist.
        advance: called after each trajectory, with True if it is of an earlier run.
    """
    out.mkdir(parents=True, exist_ok=True)
    outcomes = (_generate_one(job, simulator, out) for job in jobs)
    return _summarise(enumerate(outcomes), advance)


def generate_with_workers(
    jobs: Sequence[TrajectorySettings],
    launch: Launch,
    out: Path,
    worker_settings: WorkerSettings,
    advance: Callable[[bool], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
    on_progress: OnProgress = ignore_progress,
) -> GeneratedSet:
    """Generate as `generate_set` does, with equal files and errors, by workers of one folder.

    Args:
        jobs: see `generate_set`.
        launch: simulator that each worker starts.
        out: see `generate_set`.
        worker_settings: number and place of the workers.
        advance: see `generate_set`.
        notify: called with messages about the workers.
        on_progress: called within a trajectory, if this process is the worker.
    """
    out.mkdir(parents=True, exist_ok=True)
    # Frames are drawn by the replay. A dead end goes back some tasks, whose states are kept.
    simulator = partial(Simulator, launch, image=False, max_copies=_MAX_COPIES)
    shown = on_progress if worker_settings.is_local else ignore_progress
    start = partial(SimulatorWorker, simulator, partial(_generate_one, out=out, on_progress=shown))
    return _summarise(run_jobs(start, jobs, worker_settings, notify), advance)


def _summarise(
    outcomes: Iterable[tuple[int, _GenerationOutcome | InfthorError]],
    advance: Callable[[bool], None],
) -> GeneratedSet:
    result = GeneratedSet()

    def failed(_: int, error: InfthorError) -> _GenerationOutcome:
        return _GenerationOutcome(failure=str(error))

    for outcome in collect_outcomes(outcomes, failed, advance):
        if outcome.path is None:
            result.failures.append(str(outcome.failure))
            continue
        result.paths.append(outcome.path)
        result.steps += outcome.steps
        if outcome.needs_memory is not None:
            result.final_tasks[outcome.path.stem] = outcome.needs_memory
        if outcome.statistics is None:
            result.resumed += 1
        else:
            result.statistics.add(outcome.statistics)
            result.kept += outcome.statistics.gave_up
    return result


def _generate_one(
    job: TrajectorySettings,
    simulator: Simulator,
    out: Path,
    on_progress: OnProgress = ignore_progress,
) -> _GenerationOutcome:
    path = out / f"{file_name(job.traj_id)}.json"
    try:
        if is_written(path):
            return _GenerationOutcome.of(path, _read_earlier(path, job))
        with freeze_existing_objects():
            generated = generate(job, simulator, on_progress)
    except InfthorError as error:
        return _GenerationOutcome(failure=str(error))
    # Outside of `try`: if this file has no room, generating the other trajectories would be wasted.
    _write(generated, path)
    return _GenerationOutcome.of(path, generated.trajectory, generated.statistics)


def _write(generated: GeneratedTrajectory, path: Path) -> None:
    folder = path.with_suffix(".pddl")
    hint = writing_hint(" and run the same command again, which resumes")
    with wrap_errors(f"{path}: cannot be written", hint):
        folder.mkdir(exist_ok=True)
        (folder / "domain.pddl").write_text(DOMAIN)
        for number, problem in enumerate(generated.problems):
            (folder / f"task-{number:03d}.pddl").write_text(problem)
        with write_atomically(path) as partial_file:  # last: if this file exists, the others do
            partial_file.write_bytes(encode_trajectory(generated.trajectory))


def _read_earlier(path: Path, job: TrajectorySettings) -> Trajectory:
    """Return the trajectory of an earlier run, if it has the same settings."""
    trajectory = next(iter_sources(path)).read()
    if not job.document().items() <= (trajectory.gen_info or {}).items():
        raise UsageError(
            f"{path}: generated with other settings; remove it or choose another --out"
        )
    return trajectory
