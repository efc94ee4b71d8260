"""What runs of plans find."""

from typing import Any

from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.summary import PlanTaskSummary
from infthor_eval.runs import RunOutcome

__all__ = ["cells", "endings", "payloads", "says", "summary"]


def payloads(outcome: RunOutcome) -> list[PlanRecord]:
    """What was found of each plan."""
    return [record.payload for record in outcome.records]


def endings(outcome: RunOutcome) -> list[str]:
    """How each plan ended."""
    return [record.payload.ended for record in outcome.records]


def says(outcome: RunOutcome) -> list[list[str]]:
    """The model's replies in each plan."""
    return [[step.reply for step in record.payload.steps] for record in outcome.records]


def summary(outcome: RunOutcome, task: str = "infthor_plans") -> PlanTaskSummary:
    """What was found of a task."""
    return outcome.summary.summary.tasks[task]


def cells(outcome: RunOutcome, title: str) -> dict[str, Any]:
    """A table's one row, by the names of its columns."""
    (table,) = [
        table
        for table in outcome.run.suite.tables([outcome.summary])
        if table.title.startswith(title)
    ]
    (row,) = [row for row in table.rows if not row.is_published]
    return dict(zip((column.name for column in table.columns), row.cells, strict=False))
