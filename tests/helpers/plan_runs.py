"""Runs of plans made by hand: no simulator, no model."""

from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.episodes.records import DONE
from infthor_eval.formats.object_ids import Words
from infthor_eval.plans.config import PlansConfig, PlansTaskConfig
from infthor_eval.plans.recorded.runs import PlansRun
from infthor_eval.plans.records import PlanRecord, StepRecord
from infthor_eval.runs import RunHeader, Tokens, UnitRecord

TASK = "infthor_plans"
RULES = {"name": "default"}


def make_plans_config(
    trajectories: Sequence[str],
    model: Mapping[str, Any] | None = None,
    simulator: str = "embedded",
    task: str = TASK,
    rewards: Mapping[str, Any] | None = None,
    after_failure: str = "continue",
) -> PlansConfig:
    """The config of a run on these trajectories, as in its header."""
    config = PlansTaskConfig(
        settings={"dataset_kwargs": {}},
        trajectories={name: f"digest of {name}" for name in trajectories},
        rewards=dict(rewards or RULES),
        words=Words.PUBLISHED,
        after_failure=after_failure,
        broken=(),
    )
    return PlansConfig(
        suite="plans",
        model=dict(model or {"name": "a model"}),
        simulator=simulator,
        frames="shown",
        tasks={task: config},
    )


def make_plan_record(
    trajectory: str,
    index: int,
    steps: tuple[int, int],
    reward: float = 0.0,
    *,
    most: float | None = None,
    context: int | None = None,
    context_of_step: int | None = None,
    ended: str = DONE,
    failure: str | None = None,
    excluded: str | None = None,
    task: str = TASK,
) -> UnitRecord[PlanRecord]:
    """The record of a plan over the expert's steps [first, end)."""
    first, end = steps
    payload = PlanRecord(
        index=index,
        kind="GotoLocation",
        plan="go to the fridge",
        goal="put a mug into the fridge",
        task=0,
        first_step=first,
        n_expert_steps=end - first,
        steps=(StepRecord(n_context_tokens=context_of_step),)
        if context_of_step is not None
        else (),
        reward=reward,
        max_reward=most,
        ended=ended,
    )
    return UnitRecord(
        task=task,
        id=f"{trajectory}/{index:04d}",
        cluster=trajectory,
        fingerprint=f"{trajectory}/{index}",
        payload=payload,
        failure=failure,
        excluded=excluded,
        tokens=Tokens(context=context),
    )


def make_plans_run(label: str, records: Sequence[UnitRecord[PlanRecord]], **about: Any) -> PlansRun:
    """A run of these plans; `about` is what `make_plans_config` takes."""
    names = list(dict.fromkeys(record.cluster for record in records))
    header = RunHeader(suite="plans", name=label, config=make_plans_config(names, **about))
    return PlansRun(label, header, records)


def make_planner_run(
    records: Sequence[UnitRecord[PlanRecord]], label: str = "planner", **about: Any
) -> PlansRun:
    """The run of the planner, which is the upper bound."""
    return make_plans_run(label, records, model={"name": "planner", "baseline": "planner"}, **about)
