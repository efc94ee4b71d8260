"""Plans as samples."""

from collections.abc import Mapping
from typing import Any

from infthor_eval.plans.recorded_runs import PlansRun
from infthor_eval.plans.records import PlanRecord
from infthor_eval.report.room_map import draw_map
from infthor_eval.report.web.episode_samples import EpisodeKind, Head
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.samples import StepRow
from infthor_eval.runs import UnitRecord

__all__ = ["PLANS", "plans_run"]

Record = UnitRecord[PlanRecord]


def plans_run(run: ReportRun) -> PlansRun:
    """The same run, as curves and replays take it."""
    return PlansRun(run.label, run.header, run.records)


def _head(record: Record) -> Head:
    return Head(record.payload.plan, record.payload.kind, record.payload.goal)


def _rows(payload: PlanRecord) -> list[StepRow]:
    return [
        StepRow(
            action=_called(step.action, step.call),
            reply=said if (said := (step.reply or "").strip()) != step.action else "",
            wrong=step.message,
            reward=round(step.reward, 4),
            told="" if step.n_context_tokens is None else f"{step.n_context_tokens:,} tokens",
        )
        for step in payload.steps
    ]


def _called(action: str, call: Mapping[str, Any] | None) -> str:
    """In words; of a yardstick's action the record has the call's name alone, and its object beside it."""
    named = (call or {}).get("objectId")
    bare = call is not None and action == call.get("action") and isinstance(named, str)
    return f"{action} {str(named).partition('|')[0]}" if bare else action


PLANS = EpisodeKind(draw_map, _head, _rows)
