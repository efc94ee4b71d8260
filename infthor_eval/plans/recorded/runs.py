"""Recorded runs of plans, and the plans that several of them have in common."""

from collections.abc import Sequence

from infthor_eval.episodes.recorded_runs import RecordedRun
from infthor_eval.episodes.shared_units import (
    SharedUnits,
    difference_notes,
    shared_tasks,
    shared_units,
)
from infthor_eval.errors import UsageError
from infthor_eval.plans.config import PlansConfig
from infthor_eval.plans.records import PlanRecord


class PlansRun(RecordedRun[PlanRecord, PlansConfig]):
    """The journal of a run of plans."""

    planner = "planner"

    @property
    def config(self) -> PlansConfig:
        """The run's config; raises UsageError if the run has counts alone."""
        config = super().config
        if any(task.rewards is None for task in config.tasks.values()):
            raise UsageError(
                f"{self.label}: imported counts have no steps and no rewards; give runs made here"
            )
        return config


def shared_plans(runs: Sequence[PlansRun], task: str | None) -> SharedUnits[PlanRecord]:
    """Find a task's plans (None: the only shared one) in trajectories that all runs have in
    full."""
    shared = shared_tasks(runs, None if task is None else [task])
    if len(shared) > 1:
        raise UsageError(
            f"the runs share several tasks; give one of them with --task: {', '.join(shared)}"
        )
    configs = [run.config.tasks[shared[0]] for run in runs]
    for run, config in zip(runs, configs, strict=True):
        if config.rewards != configs[0].rewards:
            raise UsageError(
                f"{runs[0].label} and {run.label} have different reward rules; draw runs with the "
                "same --rewards"
            )
    after_failure = [config.after_failure for config in configs]
    differences = difference_notes("continuation after a failed plan", runs, after_failure)
    excluded = "plans left out, as a simulator refuses their expert"
    return shared_units(runs, shared, excluded, differences)
