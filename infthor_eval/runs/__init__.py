"""One run: its identity, its journal, and the order of its work."""

from infthor_eval.runs.budget import Budget
from infthor_eval.runs.catalog import Catalog
from infthor_eval.runs.journal import Journal, Observer, UnitRecord, read_journal
from infthor_eval.runs.run import Plan, RunOutcome, RunRequest, TaskPlan, execute, plan

__all__ = [
    "Budget",
    "Catalog",
    "Journal",
    "Observer",
    "Plan",
    "RunOutcome",
    "RunRequest",
    "TaskPlan",
    "UnitRecord",
    "execute",
    "plan",
    "read_journal",
]
