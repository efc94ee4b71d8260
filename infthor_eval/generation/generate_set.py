"""Generating many trajectories into a directory, so that stopping and starting continues."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from infthor_eval.errors import InfthorError, UsageError, naming
from infthor_eval.formats.files import written_atomically
from infthor_eval.formats.trajectory import encode_trajectory, iter_sources
from infthor_eval.generation.factory import GeneratedTrajectory, TaskStatistics, generate
from infthor_eval.generation.garbage import libraries_set_aside
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.pddl import DOMAIN
from infthor_eval.thor.simulator import Simulator

__all__ = ["GeneratedSet", "GenerationSummary", "TaskCounts", "generate_set"]


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


def generate_set(
    jobs: Sequence[TrajectorySettings], simulator: Simulator, out: Path, progress: Callable[[], None] = lambda: None
) -> GeneratedSet:
    """Make the trajectories that `out` does not have yet, one file each, and beside it their tasks as PDDL.

    Args:
        jobs: what to make.
        simulator: where it happens.
        out: directory of the files; made where it does not exist.
        progress: is called after each trajectory.

    Raises:
        DataError: a trajectory cannot be written; those before it stay.
    """
    out.mkdir(parents=True, exist_ok=True)
    result = GeneratedSet()
    for job in jobs:
        path = out / f"{job.traj_id}.json"
        try:
            made = None if path.exists() else _made(job, simulator)
            result.steps += _earlier(path, job) if made is None else len(made.trajectory.plan.low_actions)
        except InfthorError as error:
            result.failures.append(str(error))
        else:
            result.paths.append(path)
            if made is None:
                result.resumed += 1
            else:  # not a failure of this one: where it has no room, the others would be made in vain
                result.statistics.add(made.statistics)
                _write(made, path)
        progress()
    return result


def _made(job: TrajectorySettings, simulator: Simulator) -> GeneratedTrajectory:
    with libraries_set_aside():
        return generate(job, simulator)


def _write(made: GeneratedTrajectory, path: Path) -> None:
    folder = path.with_suffix(".pddl")
    with naming(f"{path}: cannot be written", "make room and run the same command again, which goes on where it was"):
        folder.mkdir(exist_ok=True)
        (folder / "domain.pddl").write_text(DOMAIN)
        for number, problem in enumerate(made.problems):
            (folder / f"task-{number:03d}.pddl").write_text(problem)
        with written_atomically(path) as partial:  # it comes last: where it is, everything is
            partial.write_bytes(encode_trajectory(made.trajectory))


def _earlier(path: Path, job: TrajectorySettings) -> int:
    trajectory = next(iter_sources(path)).read()
    made = trajectory.gen_info or {}
    if made.get("settings") != job.document():
        raise UsageError(f"{path}: made with other settings; remove it or choose another --out")
    return len(trajectory.plan.low_actions)
