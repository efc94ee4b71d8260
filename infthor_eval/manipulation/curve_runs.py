"""Runs of manipulation that are drawn together: the tasks, the trajectories and the episodes that all of them have."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.episodes.run_identity import About, about, shared_tasks
from infthor_eval.episodes.shared_units import differing, shared_units, sharing_notes
from infthor_eval.errors import DataError, UsageError, unknown_name
from infthor_eval.manipulation.kinds import ErrandKind
from infthor_eval.manipulation.records import RECORDS, ArmRecord
from infthor_eval.runs import RunHeader, UnitRecord, read_run

__all__ = ["ArmRun", "SharedEpisodes", "TaskAbout", "arm_runs", "shared_episodes", "with_radii"]

_PLANNER = "planner-arm"  # `actors.PlannerArm.name`, which would bring the simulator with it
_REWARD, _RADIUS = "reward", "radius"  # settings that are looked at by themselves

Record = UnitRecord[ArmRecord]


class TaskAbout(msgspec.Struct, frozen=True):
    """What an identity says of a task, as far as pictures need it."""

    kind: ErrandKind
    radius: float
    trajectories: dict[str, str]  # name to digest
    instruction: str | None = None
    config: dict[str, Any] = {}  # the task file's settings

    @property
    def settings(self) -> dict[str, Any]:
        """What the task file says in `dataset_kwargs`."""
        found = self.config.get("dataset_kwargs")
        return dict(found) if isinstance(found, dict) else {}


@dataclass(frozen=True)
class ArmRun:
    """A run's journal, read.

    Attributes:
        label: what the run is called beside the others.
        header: who it is.
        records: of all its episodes.
    """

    label: str
    header: RunHeader
    records: Sequence[Record]

    @cached_property
    def about(self) -> About[TaskAbout]:
        """What its identity says.

        Raises:
            DataError: it is not that of a run of manipulation.
        """
        found: About[TaskAbout] = about(self.label, self.header, About[TaskAbout], "manipulation")
        return found

    @property
    def is_planner(self) -> bool:
        """Whether the subject knows where everything is."""
        return self.about.is_baseline(_PLANNER)


def arm_runs(folders: Sequence[Path], labels: Sequence[str]) -> list[ArmRun]:
    """Runs by their folders.

    Raises:
        DataError: a journal cannot be read.
    """
    found = [read_run(folder, RECORDS) for folder in folders]
    return [ArmRun(label, *run) for label, run in zip(labels, found, strict=True)]


def with_radii(runs: Sequence[ArmRun]) -> list[ArmRun]:
    """The same, with the radius of the hand in the labels where it is not one in all of them."""
    radii = [sorted({task.radius for task in run.about.tasks.values()}) for run in runs]
    if all(found == radii[0] for found in radii):
        return list(runs)
    told = [" and ".join(f"{radius:g}" for radius in found) for found in radii]
    return [replace(run, label=f"{run.label}, {radius} m") for run, radius in zip(runs, told, strict=True)]


@dataclass(frozen=True)
class SharedEpisodes:
    """What runs have in common.

    Attributes:
        tasks: names by kind; at least one, and at most one of each kind.
        trajectories: names.
        records: by run, then by trajectory: those of the episodes that count in every run, in time order.
        notes: what was left out, a line each.
    """

    tasks: dict[ErrandKind, str]
    trajectories: tuple[str, ...]
    records: tuple[tuple[tuple[Record, ...], ...], ...]
    notes: tuple[str, ...]

    @property
    def named(self) -> str:
        """The tasks, in words."""
        return " and ".join(self.tasks.values())


def shared_episodes(runs: Sequence[ArmRun], tasks: str | None, *, one_radius: bool = True) -> SharedEpisodes:
    """Find the episodes that all runs have: of one task of each kind, in trajectories that each run has in full.

    Args:
        runs: at least one.
        tasks: which tasks of theirs, separated by commas; None takes all that they share.
        one_radius: whether a note is to say that the radius of the hand differs.

    Raises:
        UsageError: they share no task, or several of a kind, or a success earns more in one than in another.
        DataError: they share no trajectory, or an identity is not that of a run of manipulation.
    """
    found = _shared_tasks(runs, tasks)
    _require_same_rewards(runs, found)
    names = set(found.values())
    shared = shared_units([_by_trajectory(run, names) for run in runs], [_digests(run, names) for run in runs])
    if not shared.trajectories:
        told = " and ".join(found.values())
        raise DataError(f"the runs share no trajectory of {told} that all of them have in full; draw runs on same data")
    notes = sharing_notes(shared, "episodes left out, in which some run's simulator lets nobody act")
    return SharedEpisodes(found, shared.trajectories, shared.records, (*notes, *_differences(runs, found, one_radius)))


def _shared_tasks(runs: Sequence[ArmRun], tasks: str | None) -> dict[ErrandKind, str]:
    shared = shared_tasks(runs)
    wanted = shared if tasks is None else [name.strip() for name in tasks.split(",")]
    found: dict[ErrandKind, str] = {}
    for name in wanted:
        if name not in shared:
            raise unknown_name("task of all these runs", name, shared)
        kind = runs[0].about.tasks[name].kind
        if found.setdefault(kind, name) != name:
            raise UsageError(f"{found[kind]} and {name} are both of {kind}; give one of each kind with --task")
    return {kind: found[kind] for kind in ErrandKind if kind in found}


def _require_same_rewards(runs: Sequence[ArmRun], tasks: dict[ErrandKind, str]) -> None:
    """See that a success earns the same, in whatever episode."""
    for name in tasks.values():
        points = [{record.payload.max_reward for record in run.records if record.task == name} for run in runs]
        for run, found in zip(runs, points, strict=True):
            if len(found | points[0]) > 1 and found and points[0]:
                raise UsageError(
                    f"{runs[0].label} and {run.label} earn different rewards in {name}; draw runs of the same task file"
                )


def _by_trajectory(run: ArmRun, tasks: set[str]) -> dict[str, dict[tuple[int, str], Record]]:
    """Records by trajectory, and by the expert's action that they stand for."""
    found: dict[str, dict[tuple[int, str], Record]] = {}
    for record in run.records:
        if record.task in tasks:
            found.setdefault(record.cluster, {})[record.payload.index, record.task] = record
    return found


def _digests(run: ArmRun, tasks: set[str]) -> dict[str, str]:
    return {key: value for name in sorted(tasks) for key, value in run.about.tasks[name].trajectories.items()}


def _differences(runs: Sequence[ArmRun], tasks: dict[ErrandKind, str], one_radius: bool) -> list[str]:
    """In what the runs differ beside their models."""
    labels = [run.label for run in runs]
    notes = differing("simulator", labels, [run.about.simulator for run in runs])
    radii = sorted({run.about.tasks[name].radius for run in runs for name in tasks.values()})
    if len(radii) > 1 and one_radius:
        notes.append(f"the radius of the hand's sphere is not one: {', '.join(f'{radius:g}' for radius in radii)} m")
    for name in tasks.values():
        of_runs = [_told_settings(run.about.tasks[name]) for run in runs]
        for key in sorted({key for settings in of_runs for key in settings} - {_REWARD, _RADIUS}):
            notes += differing(f"{key} of {name}", labels, [settings.get(key, "the default") for settings in of_runs])
    return notes


def _told_settings(task: TaskAbout) -> dict[str, Any]:
    """The settings of a task, with what the command line said instead."""
    instruction = {} if task.instruction is None else {"instruction": task.instruction}
    return task.settings | instruction
