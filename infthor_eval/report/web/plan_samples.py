"""Plans as samples."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from infthor_eval.agents.curve_runs import PlansRun
from infthor_eval.agents.moments import Moment
from infthor_eval.agents.records import PlanRecord
from infthor_eval.report.room_map import draw_map
from infthor_eval.report.web.episode_samples import Look, Pictured, episode_samples, pictured
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.samples import Sample, StepRow
from infthor_eval.report.web.thumbnails import Thumbnails
from infthor_eval.runs import UnitRecord

__all__ = ["plan_samples", "plans_run"]

Record = UnitRecord[PlanRecord]
_DRAWN = 560  # pixels that a map is drawn at; its letters are to be read when it is made smaller


def plans_run(run: ReportRun) -> PlansRun:
    """The same run, as curves and replays take it."""
    return PlansRun(run.label, run.header, run.records)


def plan_samples(
    runs: Sequence[ReportRun], data: Path | None, scenes: Path | None, most: int, thumbnails: Thumbnails
) -> tuple[list[Sample], list[str]]:
    """All plans, some of them with what was seen.

    Args:
        runs: of plans.
        data: where the trajectories lie that do not come with the package; None asks each run where its were.
        scenes: folder with recorded floor plans.
        most: plans of each run that are carried out again.
        thumbnails: takes what is seen.

    Returns:
        The samples, and what must be said.
    """
    seen = [_pictured(run, data or run.data, scenes, most, thumbnails) for run in runs]
    problems = [problem for found in seen for problem in found.problems]
    return episode_samples(runs, seen, _head, _rows), problems


def _pictured(run: ReportRun, data: Path | None, scenes: Path | None, most: int, thumbnails: Thumbnails) -> Pictured:
    @contextmanager
    def replayed(task: str, trajectory: str, records: Sequence[Record]) -> Iterator[Iterator[Look]]:
        # Replaying brings the simulator's client with it, which a page of questions does without.
        from infthor_eval.agents.replaying import recorded_plans, replay

        recorded = recorded_plans(plans_run(run), task, trajectory)
        with replay(recorded, str(data) if data else None, scenes) as stage:
            yield (_look(stage.moments([record])) for record in records)

    return pictured(run, most, thumbnails, replayed)


def _look(moments: Iterable[Moment]) -> Look:
    found = list(moments)
    sights = [moment.sight for moment in found if moment.sight is not None]
    note = next((moment.note for moment in found if moment.note), "")
    drawn = draw_map(sights[-1], _DRAWN) if sights else None
    return Look([sight.frame for sight in sights], drawn, note)


def _head(record: Record) -> Mapping[str, str]:
    payload = record.payload
    return {"title": payload.plan, "kind": payload.kind, "wanted": payload.goal}


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
