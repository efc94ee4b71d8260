"""A suite's view of the journal that its results go to."""

from typing import Any, Generic

import msgspec

from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.records import Artifact, Payload, Unit, UnitRecord, describe_failure
from infthor_eval.runs.journals.tracebacks import TracebackFile
from infthor_eval.runs.usage import NOTHING, Usage


class JournalSession(Generic[Payload]):
    """The `Session` of a run with a journal."""

    def __init__(self, journal: Journal[Payload]) -> None:
        self.journal = journal
        self._tracebacks = TracebackFile(journal.folder)

    def find_record(self, unit: Unit[Payload], fingerprint: str) -> UnitRecord[Payload] | None:
        """See `Session`."""
        return self.journal.find_record(unit.key, fingerprint)

    def describe_failure(self, unit: Unit[Payload], error: BaseException) -> str:
        """See `Session`."""
        attempt = 1 + max(
            (record.attempt for record in self.journal.latest_records([unit.key])), default=0
        )
        file = self._tracebacks.append(unit.key, attempt, error)
        return describe_failure(error) + (f"; traceback in {file}" if file else "")

    def find_artifact(self, fingerprint: str, kind: type[Artifact]) -> Artifact | None:
        """See `Session`."""
        return self.journal.find_artifact(fingerprint, kind)

    def cache_artifact(self, fingerprint: str, artifact: Any, usage: Usage = NOTHING) -> None:
        """See `Session`."""
        self.journal.cache_artifact(fingerprint, artifact, usage)

    def append_new(self, record: UnitRecord[Payload]) -> tuple[UnitRecord[Payload], bool]:
        """Put a suite's record on disk unless it is there; return it, and True if it was there."""
        if self.journal.holds(record):
            return record, True
        return self.journal.append(self._note_changed_inputs(record)), False

    def _note_changed_inputs(self, record: UnitRecord[Payload]) -> UnitRecord[Payload]:
        """Add a fault to a record whose unit already has a result from other inputs."""
        earlier = self.journal.result_of(record.key)
        if earlier is None or not record.fingerprint or earlier.fingerprint == record.fingerprint:
            return record
        changed = (
            f"its inputs changed since attempt {earlier.attempt}: a frame, a text or a trajectory "
            "is another now"
        )
        return msgspec.structs.replace(record, faults=(*record.faults, changed))
