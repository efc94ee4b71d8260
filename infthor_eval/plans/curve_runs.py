"""Runs of plans that are drawn together: the task, the trajectories and the plans that all of them have."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import msgspec

from infthor_eval.episodes.run_identity import About, about, shared_tasks
from infthor_eval.episodes.shared_units import differing, shared_units, sharing_notes
from infthor_eval.errors import DataError, UsageError, unknown_name
from infthor_eval.plans.records import PlanRecord
from infthor_eval.runs import RunHeader, UnitRecord

__all__ = ["PlansRun", "SharedPlans", "shared_plans"]

_PLANNER = "planner"  # `baselines.Planner.name`, which would bring the simulator with it

Record = UnitRecord[PlanRecord]


class _TaskAbout(msgspec.Struct, frozen=True):
    """What an identity says of a task, as far as curves need it."""

    trajectories: dict[str, str]  # name to digest
    rewards: Any
    after_failure: str
    config: dict[str, Any] = {}  # the task file's settings


@dataclass(frozen=True)
class PlansRun:
    """A run's journal, read.

    Attributes:
        label: what the run is called beside the others.
        header: who it is.
        records: of all its plans.
    """

    label: str
    header: RunHeader
    records: Sequence[Record]

    @cached_property
    def about(self) -> About[_TaskAbout]:
        """What its identity says.

        Raises:
            DataError: it is not that of a run of plans.
        """
        found: About[_TaskAbout] = about(self.label, self.header, About[_TaskAbout], "plans")
        return found

    @property
    def is_planner(self) -> bool:
        """Whether the subject is the expert itself."""
        return self.about.is_baseline(_PLANNER)


@dataclass(frozen=True)
class SharedPlans:
    """What runs have in common.

    Attributes:
        task: the task.
        trajectories: names.
        records: by run, then by trajectory: those of the plans that count in every run, in time order.
        notes: what was left out, and in what the runs differ; a line each.
    """

    task: str
    trajectories: tuple[str, ...]
    records: tuple[tuple[tuple[Record, ...], ...], ...]
    notes: tuple[str, ...]


def shared_plans(runs: Sequence[PlansRun], task: str | None) -> SharedPlans:
    """Find the plans that all runs have: of one task, in trajectories of which each run has a record of every plan.

    Raises:
        UsageError: they share no task or several, or their rewards follow different rules.
        DataError: they share no trajectory, or an identity is not that of a run of plans.
    """
    name = _shared_task(runs, task)
    settings = [run.about.tasks[name] for run in runs]
    _require_same_rewards(runs, settings)
    found = shared_units([_by_trajectory(run, name) for run in runs], [about.trajectories for about in settings])
    if not found.trajectories:
        raise DataError(
            f"the runs share no trajectory of {name} that all of them have in full; draw runs on the same data"
        )
    labels = [run.label for run in runs]
    notes = [
        *sharing_notes(found, "plans left out, whose own expert a simulator refused"),
        *differing("course after a failed plan", labels, [about.after_failure for about in settings]),
        *differing("simulator", labels, [run.about.simulator for run in runs]),
    ]
    return SharedPlans(name, found.trajectories, found.records, tuple(notes))


def _shared_task(runs: Sequence[PlansRun], task: str | None) -> str:
    shared = shared_tasks(runs)
    if task is None and len(shared) > 1:
        raise UsageError(f"the runs share several tasks; give one of them with --task: {', '.join(shared)}")
    if task is not None and task not in shared:
        raise unknown_name("task of all these runs", task, shared)
    return task or shared[0]


def _require_same_rewards(runs: Sequence[PlansRun], settings: Sequence[_TaskAbout]) -> None:
    for run, found in zip(runs, settings, strict=True):
        if found.rewards != settings[0].rewards:
            raise UsageError(
                f"{runs[0].label} and {run.label} have different rules of rewards; draw runs with the same --rewards"
            )


def _by_trajectory(run: PlansRun, task: str) -> dict[str, dict[int, Record]]:
    """Records of a task by trajectory and by the plan's place in it."""
    found: dict[str, dict[int, Record]] = {}
    for record in run.records:
        if record.task == task:
            found.setdefault(record.cluster, {})[record.payload.index] = record
    return found
