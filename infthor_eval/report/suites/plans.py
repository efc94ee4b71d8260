"""Presenter of plans: what an agent did step by step, and the reward it earned."""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from msgspec import UNSET

from infthor_eval.errors import UsageError
from infthor_eval.plans.recorded.curves import plan_curves
from infthor_eval.plans.recorded.runs import PlansRun
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.summary import PlansSummary
from infthor_eval.plans.twins.results import score_pairs
from infthor_eval.report.charts import Chart
from infthor_eval.report.descriptions import Description, StepRow
from infthor_eval.report.presenter import (
    EpisodeSelection,
    Figure,
    FigureRequest,
    FigureResult,
    GroupScore,
    Recording,
    Replay,
)
from infthor_eval.report.recordings.plan_pictures import plan_pictures
from infthor_eval.report.recordings.room_map import draw_map
from infthor_eval.report.suites.episodes import PLAN_COLUMNS, EpisodesPresenter
from infthor_eval.report.suites.reward_curves import curves_on_page, curves_result, figure_section
from infthor_eval.report.web.sections import Section
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord
from infthor_eval.tables import Table

if TYPE_CHECKING:
    from infthor_eval.plans.recorded.replaying import RecordedPlans

Record = UnitRecord[PlanRecord]


def _select_recorded(run: Run, selection: EpisodeSelection) -> Recording:
    """Find the selected plans in a run; see `Replay.select`."""
    from infthor_eval.plans.recorded.replaying import recorded_plans, replay_plans

    recorded = recorded_plans(_plans_run(run), selection.task, selection.trajectory)
    return Recording(
        trajectory=recorded.trajectory,
        tasks=recorded.tasks,
        records=_select_plans(recorded, selection.plans),
        simulator=recorded.run.config.simulator,
        open=partial(replay_plans, recorded),
    )


def _select_plans(recorded: "RecordedPlans", plans: str | None) -> Sequence[Record]:
    if plans is None:
        return recorded.records
    numbers = re.fullmatch(r"(\d{1,9})(?:-(\d{1,9}))?", plans.strip())
    if numbers is None:
        raise UsageError(
            f"--plans {plans!r:.60}: is neither a plan's number nor two of them; write 7, or 3-7"
        )
    return recorded.between(int(numbers[1]), int(numbers[2] or numbers[1]))


def _plans_run(run: Run) -> PlansRun:
    return PlansRun(run.label, run.header, run.records)


def _build_figure_7(runs: Sequence[Run], request: FigureRequest) -> FigureResult:
    curves = plan_curves([_plans_run(run) for run in runs], request.task)
    return curves_result(curves, request.panels)


class PlansPresenter(EpisodesPresenter):
    """See `PlainPresenter`."""

    title = "Plans"
    measure = "plans completed"
    finding = "completes {} of the plans"
    target_label = "goal"
    replay = Replay("plans", ("--plans",), _select_recorded, draw_map, plan_pictures)
    columns = PLAN_COLUMNS
    figures: Mapping[str, Figure] = {
        "7": Figure("reward of plans over steps and over context tokens", _build_figure_7)
    }

    def has_pairs(self, task: str, summary: PlansSummary) -> bool:
        """See `PlainPresenter.has_pairs`."""
        return summary.tasks[task].twins is not UNSET

    def group_scores(self, records: Sequence[Record]) -> Iterator[GroupScore]:
        """See `PlainPresenter.group_scores`: net pairs of twins."""
        for pair in score_pairs(records):
            for name, score in pair.shares.by_metric.items():
                yield GroupScore(name, pair.pair, pair.cluster, score)

    def sections(self, runs: Sequence[Run]) -> Iterator[Section]:
        """See `PlainPresenter.sections`: curves of reward for each task that all runs have."""

        def task_curves(task: str) -> tuple[Sequence[Chart], Table]:
            return curves_on_page(plan_curves([_plans_run(run) for run in runs], task))

        for task in runs[0].tasks:
            if all(task in run.tasks for run in runs):
                title = f"{task}: reward over steps and context"
                yield figure_section(f"rewards-{task}", title, partial(task_curves, task))

    def describe(self, record: Record) -> Description:
        """See `PlainPresenter.describe`."""
        return Description(record.payload.plan, record.payload.goal, record.payload.kind)

    def steps(self, record: Record) -> list[StepRow]:
        """See `PlainPresenter.steps`."""
        return [
            StepRow(
                action=_action_text(step.action, step.call),
                reply=reply if (reply := (step.reply or "").strip()) != step.action else "",
                error=step.message,
                reward=round(step.reward, 4),
                note="" if step.n_context_tokens is None else f"{step.n_context_tokens:,} tokens",
            )
            for step in record.payload.steps
        ]


def _action_text(action: str, call: Mapping[str, Any] | None) -> str:
    """Return a call with its object's type, where the record has its name alone (baselines)."""
    object_id = (call or {}).get("objectId")
    if call is not None and action == call.get("action") and isinstance(object_id, str):
        return f"{action} {object_id.partition('|')[0]}"
    return action
