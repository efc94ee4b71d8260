"""The counts of a published plan log as a run: a record per plan, of its kind, done or not.

Which of a trajectory's plans of one kind were done is not in the log: those done come first. Shares
and their intervals by trajectory do not depend on it. Nothing else is in the log, so there are no
goals, steps and rewards.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from infthor_eval.episodes.records import DONE
from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.plan_logs import LoggedPlans, PlanLog
from infthor_eval.formats.replies.logs import UnreadRow
from infthor_eval.plans.config import PlansConfig, PlansTaskConfig
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.records import PlanRecord
from infthor_eval.runs import RunHeader, Session, UnitRecord
from infthor_eval.storage.digests import fingerprint

_TASK = "infthor_final"  # the task of ours that the logs are about
_NOT_DONE = "not done"
_NO_SET_UP = "its set-up failed: the log counts no plan of it"


@dataclass(frozen=True)
class ImportedCounts:
    """The plans of a log.

    Attributes:
        log: the log.
        header: header of the run.
        records: a record per plan.
        n_failed_set_ups: trajectories without a plan.
        refused: the lines that are not imported.
    """

    log: PlanLog
    header: RunHeader
    records: tuple[UnitRecord[PlanRecord], ...]
    n_failed_set_ups: int
    refused: tuple[UnreadRow, ...]

    def make_records(self, _: Session[PlanRecord]) -> tuple[UnitRecord[PlanRecord], ...]:
        """Return the records, see `store_run`."""
        return self.records


def import_counts(log: PlanLog, model: str | None = None) -> ImportedCounts:
    """Return the run that a log holds; `model` names it, None for the published log's model."""
    name = model or log.model
    if name is None:
        raise UsageError(f"{log.path}: its name has no model; give one with --model")
    whole = [row for row in log.rows if row.goto.n + row.pick.n + row.put.n >= row.total.n]
    mixed = sorted({row.line for row in log.rows} - {row.line for row in whole})
    problem = "counts plans of other kinds than goto, pick and put"
    refused = tuple(UnreadRow(line, problem) for line in mixed)
    records = tuple(record for row in whole for record in _records(row))
    if not records:
        hint = "give a log that counts goto, pick and put"
        raise DataError(f"{log.path}: none of its plans can be imported; {hint}")
    without = [row.traj_id for row in log.rows if not row.total.n]
    unread = (*log.unread, *refused)
    return ImportedCounts(log, _header(name, log, without, unread), records, len(without), unread)


def _header(
    name: str, log: PlanLog, without: list[str], refused: tuple[UnreadRow, ...]
) -> RunHeader:
    broken = [(traj_id, _NO_SET_UP) for traj_id in without]
    broken += [(f"line {row.line}", row.reason) for row in refused]
    task = PlansTaskConfig(
        settings={"task": _TASK, "dataset_kwargs": {"plans": "final"}},
        sources={"logs": {log.path.name: log.digest}},
        broken=tuple(broken),
        rewards=None,
    )
    config = PlansConfig(tasks={_TASK: task}, simulator="unity", frames="shown")
    model = {"name": name, "imported": True}
    return RunHeader(suite="plans", name=name, config=config.complete("plans", model))


def _records(row: LoggedPlans) -> Iterator[UnitRecord[PlanRecord]]:
    kinds = (PlanKind.GOTO, row.goto), (PlanKind.PICKUP, row.pick), (PlanKind.PUT, row.put)
    plans = [(kind, number, count) for kind, count in kinds for number in range(count.n)]
    for index, (kind, number, count) in enumerate(plans):
        ended = DONE if number < count.n_done else _NOT_DONE
        payload = PlanRecord(
            index=index,
            kind=str(kind),
            plan=f"{kind}, {number + 1} of {count.n}",
            goal="",
            task=0,
            first_step=0,
            n_expert_steps=0,
            is_final=True,
            ended=ended,
        )
        yield UnitRecord(
            task=_TASK,
            id=f"{row.traj_id}/{index:04d}",
            cluster=row.traj_id,
            fingerprint=fingerprint(
                {"trajectory": row.traj_id, "plan": payload.plan, "ended": ended}
            ),
            payload=payload,
        )
