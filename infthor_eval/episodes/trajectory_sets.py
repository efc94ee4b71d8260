"""The trajectories of a task: from a file, a folder, an NIEH set, or a set in the package."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.packed.paths import metadata_folder
from infthor_eval.formats.trajectory import (
    Trajectory,
    TrajectorySource,
    iter_sources,
    trajectory_files,
)
from infthor_eval.storage.folders import packaged_folder

_Broken = list[tuple[str, str]]


@dataclass(frozen=True)
class TaskTrajectory:
    """A trajectory of a task, and the digest of its file."""

    data: Trajectory
    digest: str

    @property
    def traj_id(self) -> str:
        """Name of the trajectory."""
        return self.data.traj_id


T = TypeVar("T", bound=TaskTrajectory)


@dataclass(frozen=True)
class TrajectorySet(Generic[T]):
    """All trajectories of a task.

    Attributes:
        trajectories: trajectories that can be used, ordered by name.
        broken: paths of the others within the folder, and what is wrong with each.
    """

    trajectories: Sequence[T]
    broken: Sequence[tuple[str, str]]


def find_trajectories(
    data: Path | None, bundled: str | None, read: Callable[[TrajectorySource], T]
) -> TrajectorySet[T]:
    """Read the trajectories of a task.

    Args:
        data: file or folder of trajectories, or an NIEH set that has them.
        bundled: name of a set in the package, which is used instead of `data`; None for no such
            set.
        read: reads one trajectory; raises DataError if it cannot be used.
    """
    if bundled is None and data is None:
        raise UsageError(
            "this task has no trajectories of its own; give them as --data FILE or FOLDER"
        )
    root = packaged_folder(f"sets/{bundled}") if bundled is not None else Path(str(data))
    if not root.exists():
        raise UsageError(f"--data {root}: there is no such file or folder")
    by_name: dict[str, T] = {}
    broken: _Broken = []
    for source in _sources(root, broken):
        try:
            trajectory = read(source)
        except DataError as error:
            broken.append((source.place, str(error)))
            continue
        if trajectory.traj_id in by_name:
            raise DataError(
                f"{source.place}: {trajectory.traj_id} is the name of another trajectory too; "
                "rename one"
            )
        by_name[trajectory.traj_id] = trajectory
    if not by_name:
        why = broken[0][1] if broken else "no trajectory there"
        raise DataError(f"{root}: nothing to evaluate ({why})")
    within = [(_within(root, path), _within(root, reason)) for path, reason in broken]
    return TrajectorySet([by_name[name] for name in sorted(by_name)], within)


def find_recorded_trajectory(
    task: str,
    name: str,
    digest: str | None,
    data: Path | None,
    bundled: str | None,
    read: Callable[[TrajectorySource], T],
) -> tuple[TrajectorySet[T], T]:
    """Find the trajectories that a run used, and one of them.

    Args:
        digest: digest of its file, as the run recorded it.
        data: file or folder of the trajectories; None for the set in the package.
        bundled: name of that set in the task's settings, if there is one.
    """
    if data is None and bundled is None:
        raise UsageError(
            f"the trajectories of {task} do not come with the package; give them as --data FILE or "
            "FOLDER, as for the run"
        )
    available = find_trajectories(data, None if data is not None else bundled, read)
    by_name = {trajectory.traj_id: trajectory for trajectory in available.trajectories}
    if name not in by_name:
        raise DataError(
            f"{name}: not among the trajectories of --data ({', '.join(by_name):.200}); give those "
            "of the run"
        )
    trajectory = by_name[name]
    if trajectory.digest != digest:
        raise DataError(f"{name}: changed since the run; give the run's own trajectories as --data")
    return available, trajectory


def _within(root: Path, text: str) -> str:
    """Remove the folder's own path: a run's config is the same wherever its data are."""
    return text.replace(f"{root if root.is_dir() else root.parent}/", "")


def _sources(root: Path, broken: _Broken) -> Iterator[TrajectorySource]:
    """Yield the trajectories that are there, and add files that cannot be read to `broken`.

    The trajectories of an NIEH set are beside the logs of their replay.
    """
    logs = metadata_folder(root)
    of_set = [path / "traj_data.json" for path in logs.iterdir()] if logs.is_dir() else []
    replayed = sorted((path for path in of_set if path.is_file()), key=str)
    for path in replayed or trajectory_files(root):
        try:
            yield from iter_sources(path)
        except DataError as error:
            broken.append((str(path), str(error)))
