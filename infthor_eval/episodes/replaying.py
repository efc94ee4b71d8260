"""Recorded episodes replayed, to be looked at: a journal has every action, and no frame.

Actions, rewards and endings are shown as the run recorded them. What the subject saw is recomputed:
the environment is reset to each episode and the recorded calls are repeated, which leads to the
same states if the simulator is deterministic. Where it does not, a frame notes the first
difference.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.records import EpisodeRecord
from infthor_eval.episodes.replay_frames import EpisodeFrame
from infthor_eval.episodes.shared_units import only_name
from infthor_eval.episodes.simulators import Simulators
from infthor_eval.episodes.trajectory_sets import TaskTrajectory, find_recorded_trajectory
from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import TrajectorySource
from infthor_eval.runs.journals.records import UnitRecord
from infthor_eval.thor.simulator import Simulator

P = TypeVar("P", bound=EpisodeRecord)
R = TypeVar("R", bound=RecordedRun[Any, Any])
T = TypeVar("T", bound=TaskTrajectory)
F = TypeVar("F", bound=EpisodeFrame[Any, Any])


@dataclass(frozen=True)
class RecordedTrajectory(Generic[R, P]):
    """What a run recorded of one trajectory, by name: its episodes' records in time order."""

    run: R
    trajectory: str
    records: tuple[UnitRecord[P], ...]

    @property
    def tasks(self) -> list[str]:
        """Names of the tasks that the records belong to, sorted."""
        return sorted({record.task for record in self.records})


def records_of_trajectory(
    run: RecordedRun[P, Any], tasks: Collection[str], trajectory: str | None
) -> tuple[str, tuple[UnitRecord[P], ...]]:
    """Return a trajectory's name (None: the only one) and its records in some tasks, in time
    order."""
    by_trajectory = run.by_trajectory(tasks)
    if not by_trajectory:
        raise DataError(f"{run.label}: the run has no record of an episode yet; continue it first")
    name = only_name("trajectory", "--trajectory", trajectory, sorted(by_trajectory))
    return name, tuple(by_trajectory[name][place] for place in sorted(by_trajectory[name]))


@contextmanager
def restore_trajectory(
    recorded: RecordedTrajectory[Any, Any],
    read: Callable[[TrajectorySource], T],
    data: Path | None,
    scenes: Path | None,
) -> Iterator[tuple[T, Callable[..., Simulator]]]:
    """Find the trajectory of some records, with a function that starts a simulator like the run's.

    The function takes the options of `Simulator`. Simulators are stopped at the end of the context.

    Args:
        data: file or folder of the trajectories; None for the set in the package.
        scenes: folder of recorded floor plans, for the embedded simulator.
    """
    task = recorded.records[0].task
    config = recorded.run.config.tasks[task]
    digest = config.trajectories.get(recorded.trajectory)
    bundled = config.dataset_kwargs.get("bundled")
    available, trajectory = find_recorded_trajectory(
        task, recorded.trajectory, digest, data, bundled, read
    )
    with ExitStack() as stack:

        def start_simulator(**options: Any) -> Simulator:
            # With all trajectories, as in the run: the embedded simulator completes floor plans
            # from each of them.
            every = [item.data for item in available.trajectories]
            simulators = Simulators(
                recorded.run.config.simulator, scenes, every, instances=False, **options
            )
            stack.callback(simulators.close)
            return stack.enter_context(simulators.one())

        yield trajectory, start_simulator


class EpisodeInReplay(Protocol):
    """An episode that is being replayed."""

    def repeat(self, step: Any, *, is_last: bool) -> str:
        """Repeat a recorded step unless the episode is over; return how it differs, if it does."""

    def observe(self) -> Any:
        """Return the present observation; raises DataError if the simulator sent no frame."""


class EpisodeReplay(ABC, Generic[P, F]):
    """A simulator in which recorded episodes of one trajectory are replayed."""

    @property
    @abstractmethod
    def n_episodes(self) -> int:
        """Number of episodes of the trajectory."""

    @abstractmethod
    def _begin(self, record: UnitRecord[P]) -> EpisodeInReplay:
        """Reset the world to the start of an episode."""

    @abstractmethod
    def _frame(self, record: UnitRecord[P], number: int, observation: Any, note: str) -> F:
        """Return the frame after so many steps; `observation` is None if there was no action."""

    @abstractmethod
    def _describe_step(self, record: UnitRecord[P], number: int) -> str:
        """Describe a step of an episode."""

    def frames(self, records: Sequence[UnitRecord[P]]) -> Iterator[F]:
        """Replay some episodes and yield their frames: the start of each, then one per step."""
        for record in records:
            if record.payload.attempted:
                yield from self._replay(record)
            else:
                yield self._frame(record, 0, None, "")

    def _replay(self, record: UnitRecord[P]) -> Iterator[F]:
        episode = self._begin(record)
        yield self._frame(record, 0, episode.observe(), "")
        steps = record.payload.steps
        differs = False
        for number, step in enumerate(steps, 1):
            difference = episode.repeat(step, is_last=number == len(steps))
            # Once the worlds differ all later steps may differ too, so the first difference alone
            # is noted.
            is_first = difference and not differs
            note = f"{self._describe_step(record, number)}: {difference}" if is_first else ""
            differs = differs or bool(difference)
            yield self._frame(record, number, episode.observe(), note)


def ending_of(record: UnitRecord[P], number: int) -> str:
    """Return how an episode ended with that step, or why it had no action, or an empty text."""
    if record.excluded is not None:
        return f"excluded: {record.excluded}"
    if not record.payload.attempted and record.failure is not None:
        return f"failed: {record.failure}"
    return record.payload.ended if number == len(record.payload.steps) else ""
