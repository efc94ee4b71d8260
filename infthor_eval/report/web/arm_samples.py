"""Pick-ups and puts of an arm as samples."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from infthor_eval.manipulation.curve_runs import ArmRun
from infthor_eval.manipulation.moments import ArmMoment
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.report.reach_view import draw_reach
from infthor_eval.report.web.episode_samples import Look, Pictured, episode_samples, pictured
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.samples import Sample, StepRow
from infthor_eval.report.web.thumbnails import Thumbnails
from infthor_eval.runs import UnitRecord

__all__ = ["arm_run", "arm_samples"]

Record = UnitRecord[ArmRecord]
_DRAWN = 560  # pixels, as of plans' maps


def arm_run(run: ReportRun) -> ArmRun:
    """The same run, as curves and replays take it."""
    return ArmRun(run.label, run.header, run.records)


def arm_samples(
    runs: Sequence[ReportRun], data: Path | None, scenes: Path | None, most: int, thumbnails: Thumbnails
) -> tuple[list[Sample], list[str]]:
    """All episodes, some of them with what was seen; see `plan_samples.plan_samples`."""
    seen = [_pictured(run, data or run.data, scenes, most, thumbnails) for run in runs]
    problems = [problem for found in seen for problem in found.problems]
    return episode_samples(runs, seen, _head, _rows), problems


def _pictured(run: ReportRun, data: Path | None, scenes: Path | None, most: int, thumbnails: Thumbnails) -> Pictured:
    @contextmanager
    def replayed(task: str, trajectory: str, records: Sequence[Record]) -> Iterator[Iterator[Look]]:
        # Replaying brings the simulator's client with it, which a page of questions does without.
        from infthor_eval.manipulation.replaying import recorded_episodes, replay_episodes

        recorded = recorded_episodes(arm_run(run), task, trajectory)
        with replay_episodes(recorded, str(data) if data else None, scenes) as stage:
            yield (_look(stage.moments([record])) for record in records)

    return pictured(run, most, thumbnails, replayed)


def _look(moments: Iterable[ArmMoment]) -> Look:
    found = list(moments)
    sights = [moment.sight for moment in found if moment.sight is not None]
    note = next((moment.note for moment in found if moment.note), "")
    drawn = draw_reach(sights[-1].reach, _DRAWN) if sights else None
    return Look([sight.frame for sight in sights], drawn, note)


def _head(record: Record) -> Mapping[str, str]:
    payload = record.payload
    target = payload.object_id if payload.receptacle_id is None else f"{payload.object_id} → {payload.receptacle_id}"
    return {"title": payload.instruction, "kind": payload.kind, "wanted": target}


def _rows(payload: ArmRecord) -> list[StepRow]:
    return [
        StepRow(
            action=", ".join(str(call.get("action", "")) for call in step.calls),
            reply="" if step.delta is None else " ".join(f"{value:+.3f}" for value in step.delta),
            wrong="; ".join(step.refusals),
            told=f"{step.distance:.3f} m off",
        )
        for step in payload.steps
    ]
