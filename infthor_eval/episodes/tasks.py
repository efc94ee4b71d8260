"""Task files of suites whose tasks are episodes in trajectories."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any, Generic, Protocol, TypeVar

from infthor_eval.episodes.config import EpisodeTaskConfig
from infthor_eval.episodes.trajectory_sets import TaskTrajectory, TrajectorySet, find_trajectories
from infthor_eval.formats.trajectory import TrajectorySource
from infthor_eval.runs import TaskFile, TaskRequest


class _Settings(Protocol):
    @property
    def bundled(self) -> str | None: ...


S = TypeVar("S", bound=_Settings)
T = TypeVar("T", bound=TaskTrajectory)


class EpisodeTask(ABC, Generic[S, T]):
    """A task file, its trajectories, and its settings with what the command line gives instead."""

    def __init__(
        self,
        file: TaskFile,
        request: TaskRequest[Any],
        settings: S,
        read: Callable[[TrajectorySource], T],
    ) -> None:
        """Find the trajectories of a task file."""
        self.file = file
        self.name = file.name
        self.settings = settings
        self.trajectories: TrajectorySet[T] = find_trajectories(
            request.data, settings.bundled, read
        )

    @abstractmethod
    def config(self) -> EpisodeTaskConfig:
        """Return everything that the task's numbers depend on."""

    def _shared_config(self, used: Iterable[T]) -> dict[str, Any]:
        """Return the fields of `EpisodeTaskConfig`, given the trajectories that are used."""
        return {
            "settings": dict(self.file.settings),
            "trajectories": {trajectory.traj_id: trajectory.digest for trajectory in used},
            "broken": tuple(self.trajectories.broken),
        }
