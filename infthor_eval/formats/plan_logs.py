"""Logs of the published scripts on final tasks: counts of plans, a trajectory a line (`.gz` too).

    {"traj_id": "floorplan7_12_471_1744791924", "metric": {"total_count": 4, "success_count": 1,
    "goto_count": 2,
     "goto_success": 1, "pick_count": 1, "pick_success": 0, "put_count": 1, "put_success": 0,
     "agent_reward": 0}}

A total of 0 says that the trajectory never came to its final task: the set-up failed, which means
the task just before it; of earlier ones the script leaves out the rest. `agent_reward` is not read:
it is 0 in every published row.

To add a form of plan counts that others made: here, and
`infthor_eval/plans/published/imported_counts.py`.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec

from infthor_eval.errors import DataError, in_one_line
from infthor_eval.formats.reading import json_value, lines_of
from infthor_eval.formats.replies.logs import UnreadRow
from infthor_eval.storage.digests import digest

_PUBLISHED_NAME = re.compile(r"eval_longhrz_checkpoints_(?P<model>.+?)_?\.log(?:\.gz)?$")
_HINT = "give a log of the published scripts, with the counts of a trajectory's plans a line"
# Each plan becomes a record; a task has a few.
_Number = Annotated[int, msgspec.Meta(ge=0, le=10_000)]


class PlanCount(NamedTuple):
    """How many plans were done, of how many."""

    n_done: int
    n: int


@dataclass(frozen=True)
class LoggedPlans:
    """The plans of one trajectory's final task, counted.

    Attributes:
        line: number of the line, from 1.
        traj_id: name of the trajectory.
        goto: plans of kind GotoLocation.
        pick: plans of kind PickupObject.
        put: plans of kind PutObject.
        total: all plans, those of other kinds too; none if the set-up failed.
    """

    line: int
    traj_id: str
    goto: PlanCount
    pick: PlanCount
    put: PlanCount
    total: PlanCount


@dataclass(frozen=True)
class PlanLog:
    """A log.

    Attributes:
        path: the file.
        rows: the trajectories, in the log's order.
        unread: lines that are no trajectory, or one that is in the log before.
        digest: hash of the lines, which packing does not change.
    """

    path: Path
    rows: tuple[LoggedPlans, ...]
    unread: tuple[UnreadRow, ...]
    digest: str

    @property
    def model(self) -> str | None:
        """Checkpoint and context extension, as published names have them; None for other names."""
        name = _PUBLISHED_NAME.match(self.path.name)
        return name["model"] if name else None


class _Metric(msgspec.Struct, frozen=True):
    total_count: _Number
    success_count: _Number
    goto_count: _Number
    goto_success: _Number
    pick_count: _Number
    pick_success: _Number
    put_count: _Number
    put_success: _Number


class _Row(msgspec.Struct, frozen=True):
    traj_id: Annotated[str, msgspec.Meta(min_length=1)]
    metric: _Metric


def is_plan_log(path: Path) -> bool:
    """Return whether the first JSON object of a log has counts of plans."""
    for _, line in lines_of(path, _HINT):
        try:
            entry = json_value(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(entry, dict):
            return "metric" in entry
    return False


def read_plan_log(path: Path) -> PlanLog:
    """Read a log; a bad line, such as a last one that is cut, is kept apart with the reason."""
    lines = list(lines_of(path, _HINT))
    rows: dict[str, LoggedPlans] = {}
    unread = []
    for number, line in lines:
        row = _read_line(number, line)
        if isinstance(row, UnreadRow):
            unread.append(row)
        elif row.traj_id in rows:
            unread.append(
                UnreadRow(row.line, f"has {row.traj_id!r:.80} again; the first row is kept")
            )
        else:
            rows[row.traj_id] = row
    if not rows:
        reason = f"line {unread[0].line} {unread[0].reason}" if unread else "it is empty"
        raise DataError(f"{path}: no line has counts of plans ({reason}); {_HINT}")
    return PlanLog(
        path, tuple(rows.values()), tuple(unread), digest(b"".join(line for _, line in lines))
    )


def _read_line(number: int, line: bytes) -> LoggedPlans | UnreadRow:
    try:
        return _read_row(number, json_value(line))
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        return UnreadRow(number, f"has no counts of plans ({in_one_line(error)})")


def _read_row(number: int, entry: Any) -> LoggedPlans:
    row = msgspec.convert(entry, _Row)
    metric = row.metric
    of_kinds = (
        PlanCount(metric.goto_success, metric.goto_count),
        PlanCount(metric.pick_success, metric.pick_count),
        PlanCount(metric.put_success, metric.put_count),
    )
    total = PlanCount(metric.success_count, metric.total_count)
    if any(count.n_done > count.n for count in (*of_kinds, total)):
        raise ValueError("more plans are done than there are")
    if (
        sum(count.n_done for count in of_kinds) > total.n_done
        or sum(count.n for count in of_kinds) > total.n
    ):
        raise ValueError("the total is less than its kinds together")
    return LoggedPlans(number, row.traj_id, *of_kinds, total)
