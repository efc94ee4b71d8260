"""Evaluation of episodes in simulators: what plans and manipulation have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from infthor_eval.episodes.config import EpisodesConfig
from infthor_eval.episodes.options import SimulatorOptions
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.episodes.tasks import EpisodeTask
from infthor_eval.episodes.trajectory_sets import TaskTrajectory
from infthor_eval.formats.floor_plans import floor_plans_digest
from infthor_eval.runs import (
    Group,
    Session,
    Skipped,
    TaskFile,
    TaskRequest,
    Unit,
    UnitKey,
    UnitRecord,
    Workload,
)
from infthor_eval.storage.digests import fingerprint

P = TypeVar("P", bound=EpisodeRecord)
T = TypeVar("T", bound=TaskTrajectory)
E = TypeVar("E")
K = TypeVar("K", bound=EpisodeTask[Any, Any])
Options = TypeVar("Options", bound=SimulatorOptions)

# Parts of a task's config that one episode does not depend on.
_OF_ALL_TRAJECTORIES = ("trajectories", "broken")


@dataclass(frozen=True)
class EpisodeUnit(Unit[P], Generic[P, T, E]):
    """A unit that is an episode of a trajectory."""

    trajectory: T
    episode: E

    @classmethod
    def of(cls, task: str, trajectory: T, episode: E, payload: P) -> Self:
        """Return the unit of an episode of a task; `payload` is its record before anybody acts."""
        key = UnitKey(task, f"{trajectory.traj_id}/{payload.index:04d}")
        return cls(key, trajectory.traj_id, payload, trajectory, episode)


U = TypeVar("U", bound=EpisodeUnit[Any, Any, Any])


class EpisodeEvaluation(ABC, Generic[Options, K, U]):
    """A suite of episodes set up for a run; see `infthor_eval.runs.Evaluation`.

    Attributes:
        trajectories: all trajectories that were found, used or not, so that neither what baselines
            learn nor the floor plans of the simulators depend on --limit.
    """

    def __init__(
        self,
        request: TaskRequest[Options],
        read_task: Callable[[TaskFile, TaskRequest[Options]], K],
    ) -> None:
        """Read the tasks and their trajectories."""
        self.seed = request.seed
        self.options = request.options
        self.tasks: Mapping[str, K] = {
            file.name: read_task(file, request) for file in request.tasks
        }
        self._scenes = Path(self.options.scenes) if self.options.scenes is not None else None
        self._kept: dict[tuple[Any, ...], Simulators] | None = None
        self._floor_plans = floor_plans_digest(self._scenes) if self._scenes is not None else None
        by_name = {
            trajectory.traj_id: trajectory.data
            for task in self.tasks.values()
            for trajectory in task.trajectories.trajectories
        }
        self.trajectories = list(by_name.values())

    @property
    @abstractmethod
    def units(self) -> list[U]:
        """The episodes of all tasks, task by task, in the order of trajectories and time."""

    @cached_property
    def _numbers(self) -> dict[UnitKey, int]:
        """Positions of the episodes in their tasks."""
        by_task = groupby(self.units, key=lambda unit: unit.key.task)
        return {unit.key: number for _, of_task in by_task for number, unit in enumerate(of_task)}

    @property
    def _shared_config(self) -> dict[str, Any]:
        """The fields of `EpisodesConfig`, and those that all runs have."""
        return {
            "tasks": {name: task.config() for name, task in self.tasks.items()},
            "simulator": self.options.simulator,
            "ai2thor": version("ai2thor"),
            "floor_plans": self._floor_plans,
            "frames": self.options.frames,
        }

    @property
    @abstractmethod
    def config(self) -> EpisodesConfig[Any]:
        """The suite's part of the run's config."""

    def workload(self, groups: Iterable[Iterable[U]]) -> Workload[U]:
        """Return the workload, given the episodes in groups."""
        listed = [list(units) for units in groups]
        return Workload(
            groups=[
                Group(units, frames=len(units[0].trajectory.data.plan.low_actions))
                for units in listed
            ],
            skipped=[
                Skipped(UnitKey(name, path), reason)
                for name, task in self.tasks.items()
                for path, reason in task.trajectories.broken
            ],
            config=self.config,
        )

    def simulators(self, **options: Any) -> Simulators:
        """Return simulators for the episodes, with further options of `Simulator`."""
        key = tuple(sorted(options.items()))
        if self._kept is None or key not in self._kept:
            made = Simulators(self.options.simulator, self._scenes, self.trajectories, **options)
            if self._kept is None:
                return made
            made.is_kept = True
            self._kept[key] = made
        return self._kept[key]

    @contextmanager
    def keeping_simulators(self) -> Iterator[None]:
        """Within this context, runs that follow each other use the same simulators."""
        self._kept = {}
        try:
            yield
        finally:
            for simulators in self._kept.values():
                simulators.is_kept = False
                simulators.close()
            self._kept = None


class BoundEpisodes(Generic[U, P]):
    """Episodes for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(
        self,
        evaluation: EpisodeEvaluation[Any, Any, U],
        workload: Workload[U],
        simulators: Iterable[Simulators],
    ) -> None:
        """Take the work, and the simulators that it is done in, which are closed with this."""
        self.workload = workload
        self.seed = evaluation.seed
        self._simulators_to_close = list(simulators)

    def close(self) -> None:
        """See `infthor_eval.runs.BoundEvaluation.close`."""
        with ExitStack() as stack:  # which closes the others too if one fails
            for simulators in self._simulators_to_close:
                stack.callback(simulators.close)

    def _fingerprint(self, unit: U) -> str:
        """Return the hash of everything that an episode depends on."""
        config = self.workload.config.document
        task = config.pop("tasks")[unit.key.task]
        for name in _OF_ALL_TRAJECTORIES:
            task.pop(name, None)
        return fingerprint(
            {
                **config,
                "task": task,
                "trajectory": unit.trajectory.digest,
                "index": unit.payload.index,
                "seed": self.seed,
            }
        )

    def _find_records(
        self, group: Group[U], session: Session[P]
    ) -> tuple[dict[UnitKey, str], dict[UnitKey, UnitRecord[P] | None]]:
        """Return the fingerprints of a group's units, and the records of results that are there."""
        fingerprints = {unit.key: self._fingerprint(unit) for unit in group.units}
        records = {
            unit.key: session.find_record(unit, fingerprints[unit.key]) for unit in group.units
        }
        return fingerprints, records
