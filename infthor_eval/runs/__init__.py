"""One run of any suite: its config, its journal, and the order of its work."""

from infthor_eval.runs.catalog import Catalog, TaskFile
from infthor_eval.runs.completeness import UnitCounts, count_units
from infthor_eval.runs.config import RunConfig, TaskConfig
from infthor_eval.runs.journals.records import (
    ReadHashes,
    RecordTypes,
    RunHeader,
    Tokens,
    Unit,
    UnitKey,
    UnitRecord,
)
from infthor_eval.runs.journals.requests import StoredFrames, StoredRequest
from infthor_eval.runs.journals.shards import read_header, read_run
from infthor_eval.runs.request import PreparedRun, RunRequest, prepare, prepare_all
from infthor_eval.runs.stored.command import StoredCommand, read_stored_command
from infthor_eval.runs.suite import (
    BoundEvaluation,
    Cost,
    Evaluation,
    Group,
    RunSummary,
    Session,
    Skipped,
    Suite,
    TaskRequest,
    UnitDoc,
    Workload,
    keep_request,
)
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.runs.work.binding import SharedSubject, check_runs
from infthor_eval.runs.work.driver import Observer, RunOutcome, Silent, execute
from infthor_eval.runs.work.equality import Equality, check_equality, require_switches
from infthor_eval.runs.work.estimate import Estimate, TaskEstimate, estimate_run

__all__ = [
    "NOTHING",
    "BoundEvaluation",
    "Catalog",
    "Cost",
    "Equality",
    "Estimate",
    "Evaluation",
    "Group",
    "Observer",
    "PreparedRun",
    "ReadHashes",
    "RecordTypes",
    "RunConfig",
    "RunHeader",
    "RunOutcome",
    "RunRequest",
    "RunSummary",
    "Session",
    "SharedSubject",
    "Silent",
    "Skipped",
    "StoredCommand",
    "StoredFrames",
    "StoredRequest",
    "Suite",
    "TaskConfig",
    "TaskEstimate",
    "TaskFile",
    "TaskRequest",
    "Tokens",
    "Unit",
    "UnitCounts",
    "UnitDoc",
    "UnitKey",
    "UnitRecord",
    "Usage",
    "Workload",
    "check_equality",
    "check_runs",
    "count_units",
    "estimate_run",
    "execute",
    "keep_request",
    "prepare",
    "prepare_all",
    "read_header",
    "read_run",
    "read_stored_command",
    "require_switches",
]
