"""Fetching the replies to all requests of a run in batches, before its units are evaluated."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import Unit, describe_failure
from infthor_eval.runs.journals.shards import FOLDER
from infthor_eval.runs.suite import BoundEvaluation, Session
from infthor_eval.runs.work.binding import group_records
from model_adapters import BatchModel

_BATCHES = "batches"  # beside the shards of the journal


def fetch_replies(
    subject: BatchModel,
    evaluation: BoundEvaluation[Any, Any],
    session: Session[Any],
    encoder: RecordEncoder[Any],
    folder: Path,
    notify: Callable[[str], None],
    should_stop: Callable[[], bool],
) -> bool:
    """Have the requests of all units without a result answered; return False if it was stopped.

    All units are evaluated as usual, but the subject only records what it is asked.
    """
    batches = subject.open_batches(folder / FOLDER / _BATCHES, notify, should_stop)
    while True:
        with batches.collecting():
            for group in evaluation.workload.groups:
                for _ in group_records(evaluation, group, _Collecting(session), encoder):
                    pass  # the subject keeps the requests
                if should_stop():
                    break
        if not batches.fetch():
            return not should_stop()


class _Collecting:
    """A session that keeps no traceback: failures are told when the units are evaluated."""

    def __init__(self, session: Session[Any]) -> None:
        self.find_record = session.find_record
        self.find_artifact = session.find_artifact
        self.cache_artifact = session.cache_artifact

    def describe_failure(self, unit: Unit[Any], error: BaseException) -> str:
        """See `Session`; nothing is written."""
        return describe_failure(error)
