"""A subject at work, and the journal that its results go to."""

from typing import Any

import msgspec

from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import Unit, UnitRecord
from infthor_eval.runs.usage import NOTHING, Usage
from model_adapters import Subject

__all__ = ["JournalSession"]


class JournalSession:
    """The `Session` of a run with a journal."""

    def __init__(self, subject: Subject, journal: Journal) -> None:
        self.subject = subject
        self.journal = journal

    def known(self, unit: Unit[Any], fingerprint: str) -> UnitRecord[Any] | None:
        """See `Session`."""
        return self.journal.known(unit.key, fingerprint)

    def memo(self, fingerprint: str) -> Any | None:
        """See `Session`."""
        return self.journal.memo(fingerprint)

    def keep(self, fingerprint: str, payload: Any, usage: Usage = NOTHING) -> None:
        """See `Session`."""
        self.journal.keep(fingerprint, payload, usage)

    def recorded(self, record: UnitRecord[Any]) -> tuple[UnitRecord[Any], bool]:
        """A record that a suite gave, on disk; and whether it was there already."""
        if self.journal.holds(record):
            return record, True
        return self.journal.append(self._naming_changes(record)), False

    def _naming_changes(self, record: UnitRecord[Any]) -> UnitRecord[Any]:
        """A record that says so where there was a result already, from other inputs."""
        earlier = self.journal.result_of(record.key)
        if earlier is None or not record.fingerprint or earlier.fingerprint == record.fingerprint:
            return record
        changed = f"its inputs changed since attempt {earlier.attempt}: a frame, a text or a trajectory is another now"
        return msgspec.structs.replace(record, faults=(*record.faults, changed))
