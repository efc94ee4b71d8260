"""Pick-ups and puts of an arm as samples."""

from PIL import Image

from infthor_eval.manipulation.moments import ArmSight
from infthor_eval.manipulation.recorded_runs import ArmRun
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.report.reach_view import draw_reach
from infthor_eval.report.web.episode_samples import EpisodeKind, Head
from infthor_eval.report.web.runs import ReportRun
from infthor_eval.report.web.samples import StepRow
from infthor_eval.runs import UnitRecord

__all__ = ["ERRANDS", "arm_run"]

Record = UnitRecord[ArmRecord]


def arm_run(run: ReportRun) -> ArmRun:
    """The same run, as curves and replays take it."""
    return ArmRun(run.label, run.header, run.records)


def _drawn(sight: ArmSight, size: int) -> Image.Image:
    return draw_reach(sight.reach, size)


def _head(record: Record) -> Head:
    payload = record.payload
    target = payload.object_id if payload.receptacle_id is None else f"{payload.object_id} → {payload.receptacle_id}"
    return Head(payload.instruction, payload.kind, target)


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


ERRANDS = EpisodeKind(_drawn, _head, _rows)
