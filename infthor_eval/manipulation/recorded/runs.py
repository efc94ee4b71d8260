"""Recorded runs of manipulation, and the episodes that several of them have in common."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.shared_units import (
    SharedUnits,
    difference_notes,
    shared_tasks,
    shared_units,
)
from infthor_eval.errors import UsageError
from infthor_eval.manipulation.config import ArmTaskConfig, ManipulationConfig
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.records import ArmRecord

_COMPARED_ELSEWHERE = {"reward", "radius"}  # settings that have an error and a note of their own


class ArmRun(RecordedRun[ArmRecord, ManipulationConfig]):
    """The journal of a run of manipulation."""

    planner = "planner-arm"


def label_by_radius(runs: Sequence[ArmRun]) -> list[ArmRun]:
    """Return the same runs, with the radius of the hand in their labels if it differs."""
    radii = [_radii(run) for run in runs]
    if radii.count(radii[0]) == len(runs):
        return list(runs)
    labels = [f"{run.label}, {text} m" for run, text in zip(runs, radii, strict=True)]
    return [replace(run, label=label) for run, label in zip(runs, labels, strict=True)]


def _radii(run: ArmRun) -> str:
    radii = sorted({task.radius for task in run.config.tasks.values()})
    return " and ".join(f"{radius:g}" for radius in radii)


def task_kinds(runs: Sequence[ArmRun], tasks: Sequence[str]) -> dict[ManipulationKind, str]:
    """Return the names of tasks by their kind of episode, pick-ups first."""
    kinds = {runs[0].config.tasks[name].kind: name for name in tasks}
    return {kind: kinds[kind] for kind in ManipulationKind if kind in kinds}


def shared_episodes(
    runs: Sequence[ArmRun], tasks: str | None, *, one_radius: bool = True
) -> SharedUnits[ArmRecord]:
    """Find the episodes that all runs have, of one task of each kind, in trajectories had in full.

    Args:
        runs: at least one run.
        tasks: names of the tasks, separated by commas; None for all that they share.
        one_radius: whether to note that the radius of the hand differs.
    """
    chosen = shared_tasks(
        runs, None if tasks is None else [name.strip() for name in tasks.split(",")]
    )
    kinds = task_kinds(runs, chosen[::-1])  # of two tasks of a kind the first is kept
    for name in chosen:
        kind = runs[0].config.tasks[name].kind
        if kinds[kind] != name:
            raise UsageError(
                f"{kinds[kind]} and {name} are both of {kind}; give one of each kind with --task"
            )
    names = list(kinds.values())
    _require_same_rewards(runs, names)
    excluded = "episodes left out, as a simulator cannot restore their start"
    return shared_units(runs, names, excluded, _differences(runs, names, one_radius))


def _require_same_rewards(runs: Sequence[ArmRun], tasks: Sequence[str]) -> None:
    """Check that a success earns the same in all episodes of a task."""
    for name in tasks:
        first = _rewards(runs[0], name)
        for run in runs:
            rewards = _rewards(run, name)
            if len(rewards | first) > 1 and rewards and first:
                raise UsageError(
                    f"{runs[0].label} and {run.label} earn different rewards in {name}; draw runs "
                    "of the same task file"
                )


def _rewards(run: ArmRun, task: str) -> set[float]:
    return {record.payload.max_reward for record in run.records if record.task == task}


def _differences(runs: Sequence[ArmRun], tasks: Sequence[str], one_radius: bool) -> Iterator[str]:
    """Yield notes on how the settings of the runs differ."""
    radii = sorted({run.config.tasks[name].radius for run in runs for name in tasks})
    if len(radii) > 1 and one_radius:
        yield (
            "the runs differ in the radius of the hand's sphere: "
            f"{', '.join(f'{radius:g}' for radius in radii)} m"
        )
    for name in tasks:
        settings = [_settings(run.config.tasks[name]) for run in runs]
        for key in sorted({key for of_run in settings for key in of_run} - _COMPARED_ELSEWHERE):
            values = [of_run.get(key, "the default") for of_run in settings]
            yield from difference_notes(f"{key} of {name}", runs, values)


def _settings(task: ArmTaskConfig) -> Mapping[str, Any]:
    """Return the settings of a task; an instruction of the command line wins."""
    if task.instruction is None:
        return task.dataset_kwargs
    return {**task.dataset_kwargs, "instruction": task.instruction}
