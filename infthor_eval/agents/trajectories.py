"""The trajectories that a task is about."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.agents.plans import Plan, TrajectoryTask, plans_of, tasks_of
from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.digests import digest
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.trajectory import Source, Trajectory, iter_sources, trajectory_files

__all__ = ["Course", "Courses", "find_courses"]


@dataclass(frozen=True)
class Course:
    """A trajectory that an agent is led through.

    Attributes:
        trajectory: the trajectory.
        plans: its plans.
        tasks: their tasks.
        digest: of its file.
    """

    trajectory: Trajectory
    plans: Sequence[Plan]
    tasks: Sequence[TrajectoryTask]
    digest: str

    @property
    def traj_id(self) -> str:
        """The trajectory's name."""
        return self.trajectory.traj_id


@dataclass(frozen=True)
class Courses:
    """All of them.

    Attributes:
        found: those that can be gone through, by name.
        broken: where the others lie, and what is wrong with them.
    """

    found: Sequence[Course]
    broken: Sequence[tuple[str, str]]


def find_courses(data: str | None, bundled: str | None) -> Courses:
    """Read the trajectories.

    Args:
        data: a file or folder of trajectories, or an NIEH set that has them.
        bundled: name of a set that comes with the package; `data` is not looked at then.

    Raises:
        UsageError: neither is given, or there is no such place.
        DataError: nothing there is a trajectory, or two have one name.
    """
    if bundled is None and data is None:
        raise UsageError("this task has no trajectories of its own; give them as --data FILE or FOLDER")
    root = packaged_folder(f"sets/{bundled}") if bundled is not None else Path(str(data))
    if not root.exists():
        raise UsageError(f"--data {root}: there is no such file or folder")
    found: dict[str, Course] = {}
    broken: list[tuple[str, str]] = []
    for source in _sources(root, broken):
        try:
            course = _course(source)
        except DataError as error:
            broken.append((source.place, str(error)))
            continue
        if course.traj_id in found:
            raise DataError(f"{source.place}: {course.traj_id} is the name of another trajectory too; rename one")
        found[course.traj_id] = course
    if not found:
        why = broken[0][1] if broken else "no trajectory there"
        raise DataError(f"{root}: nothing to evaluate ({why})")
    return Courses([found[name] for name in sorted(found)], [(_within(root, a), _within(root, b)) for a, b in broken])


def _within(root: Path, text: str) -> str:
    """The same without the folder's own path: a run is the same wherever its data lie."""
    return text.replace(f"{root if root.is_dir() else root.parent}/", "")


def _sources(root: Path, broken: list[tuple[str, str]]) -> Iterator[Source]:
    """What is there; files that cannot be read to their end are added to the broken ones.

    The trajectories of an NIEH set lie beside the logs of their replay.
    """
    for path in sorted(root.glob("metadata/*/traj_data.json")) or trajectory_files(root):
        try:
            yield from iter_sources(path)
        except DataError as error:
            broken.append((str(path), str(error)))


def _course(source: Source) -> Course:
    trajectory = source.read()
    plans = plans_of(trajectory)
    if not plans:
        raise DataError(f"{source.place}: no plan with an action; leave it out")
    return Course(trajectory, plans, tasks_of(trajectory), digest(source.raw.strip()))
