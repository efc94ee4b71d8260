"""The trajectories that a task is about: of a file, a folder or an NIEH set, or of a set that comes along."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.trajectory import TrajectorySource, iter_sources, trajectory_files

__all__ = ["TrajectorySet", "find_again", "find_trajectories"]


class _Named(Protocol):
    @property
    def traj_id(self) -> str: ...


class _Told(_Named, Protocol):
    @property
    def digest(self) -> str: ...


T = TypeVar("T", bound=_Named)
D = TypeVar("D", bound=_Told)
_Broken = list[tuple[str, str]]


@dataclass(frozen=True)
class TrajectorySet(Generic[T]):
    """All of them.

    Attributes:
        found: what was made of those that can be used, by name.
        broken: where the others lie, within the folder, and what is wrong with them.
    """

    found: Sequence[T]
    broken: Sequence[tuple[str, str]]


def find_trajectories(data: str | None, bundled: str | None, read: Callable[[TrajectorySource], T]) -> TrajectorySet[T]:
    """Read the trajectories.

    Args:
        data: a file or folder of trajectories, or an NIEH set that has them.
        bundled: name of a set that comes with the package; `data` is not looked at then.
        read: makes of each what the task needs; where it raises DataError the trajectory is broken.

    Raises:
        UsageError: neither is given, or there is no such place.
        DataError: nothing there is a trajectory, or two have one name.
    """
    if bundled is None and data is None:
        raise UsageError("this task has no trajectories of its own; give them as --data FILE or FOLDER")
    root = packaged_folder(f"sets/{bundled}") if bundled is not None else Path(str(data))
    if not root.exists():
        raise UsageError(f"--data {root}: there is no such file or folder")
    found: dict[str, T] = {}
    broken: _Broken = []
    for source in _sources(root, broken):
        try:
            item = read(source)
        except DataError as error:
            broken.append((source.place, str(error)))
            continue
        if item.traj_id in found:
            raise DataError(f"{source.place}: {item.traj_id} is the name of another trajectory too; rename one")
        found[item.traj_id] = item
    if not found:
        why = broken[0][1] if broken else "no trajectory there"
        raise DataError(f"{root}: nothing to evaluate ({why})")
    within = [(_within(root, place), _within(root, reason)) for place, reason in broken]
    return TrajectorySet([found[name] for name in sorted(found)], within)


def find_again(
    task: str, name: str, digest: str | None, data: str | None, bundled: object, read: Callable[[TrajectorySource], D]
) -> tuple[TrajectorySet[D], D]:
    """The trajectories that a run was made on, and one of them.

    Args:
        task: the run's task.
        name: of the one.
        digest: of its file, as the run recorded it.
        data: where they lie, see `find_trajectories`; None for those that come with the package.
        bundled: what the task's file says of that.
        read: see `find_trajectories`.

    Raises:
        UsageError: they do not come with the package, and `data` is not given or not there.
        DataError: the trajectory is not among them, or is another than the run's.
    """
    if data is None and bundled is None:
        raise UsageError(
            f"the trajectories of {task} do not come with the package; give them as --data FILE or FOLDER, "
            "as for the run"
        )
    every = find_trajectories(data, None if data is not None else str(bundled), read)
    found = next((item for item in every.found if item.traj_id == name), None)
    if found is None:
        there = ", ".join(item.traj_id for item in every.found)
        raise DataError(f"{name}: not among the trajectories of --data ({there:.200}); give those of the run")
    if found.digest != digest:
        raise DataError(f"{name}: is not what it was when the run was made; give the run's own trajectories as --data")
    return every, found


def _within(root: Path, text: str) -> str:
    """The same without the folder's own path: a run is the same wherever its data lie."""
    return text.replace(f"{root if root.is_dir() else root.parent}/", "")


def _sources(root: Path, broken: _Broken) -> Iterator[TrajectorySource]:
    """What is there; files that cannot be read to their end are added to the broken ones.

    The trajectories of an NIEH set lie beside the logs of their replay.
    """
    for path in sorted(root.glob("metadata/*/traj_data.json")) or trajectory_files(root):
        try:
            yield from iter_sources(path)
        except DataError as error:
            broken.append((str(path), str(error)))
