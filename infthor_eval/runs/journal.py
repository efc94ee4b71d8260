"""The journal of a run: every finished unit, and every note that a model took, one JSON line each, on disk before
it counts.

The first line says what run it is. A unit is found again by its task, question and variant, and counts only if the
fingerprint of its inputs is the same, so an answer given to other inputs is never taken for this one's. A line that
a killed process left unfinished is cut off when the journal is opened again.
"""

import fcntl
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

import msgspec

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.digests import canonical_json

__all__ = ["Journal", "NoteRecord", "Observer", "UnitRecord", "read_journal"]

_FORMAT = 1
_NOTE = b'{"note":'  # how the line of a note begins, and no unit's


class UnitRecord(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One question answered in one context, or the reason why it could not be.

    Attributes:
        task: the lm-eval task.
        question_id: see `Question.id`.
        variant: which of the task's ways of asking it this is ("depth=0.4"); empty where there is one.
        fingerprint: of the unit's inputs: the prompt, the frames' content, the gold answers, the decoding settings.
        traj_id: the trajectory that the question is about; intervals cluster by it.
        question: the question's text.
        question_type: its type, empty where the set names none.
        n_clues: number of frames that hold the evidence; 0 for an absence, which no frame proves.
        answers: the gold answers.
        reply: what the model said; None where it failed.
        failure: why there is no reply; None where there is one.
        n_context_tokens: length of the request in tokens, 0 where the model counts none.
        n_cached_tokens: how many of them were not encoded again.
        n_reply_tokens: length of the reply in tokens.
        seconds: time that the reply took, the encoding of its context included.
    """

    task: str
    question_id: str
    fingerprint: str
    traj_id: str
    question: str
    question_type: str
    n_clues: int
    answers: tuple[str | int | float, ...]
    variant: str = ""
    reply: str | None = None
    failure: str | None = None
    n_context_tokens: int = 0
    n_cached_tokens: int = 0
    n_reply_tokens: int = 0
    seconds: float = 0.0

    @property
    def key(self) -> tuple[str, str, str]:
        """Which unit of the run this is."""
        return self.task, self.question_id, self.variant


class NoteRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What a model noted on a few frames of a trajectory, to be shown it later instead of them.

    Attributes:
        note: the text.
        fingerprint: of the note's inputs: the prompt, the frames' content, the limit.
        traj_id: the trajectory.
        steps: which frames, as the model is told ("Steps 0-19").
        n_context_tokens: length of the request in tokens.
        n_reply_tokens: length of the note in tokens.
        seconds: time that it took.
    """

    note: str
    fingerprint: str
    traj_id: str
    steps: str
    n_context_tokens: int
    n_reply_tokens: int
    seconds: float


# Is told of each unit that is done, and whether it was found in the journal of an earlier, stopped run.
Observer = Callable[[UnitRecord, bool], None]


class _Header(msgspec.Struct, frozen=True):
    format: int
    identity: dict[str, Any]


class Journal:
    """Append-only record of one run, held by one process at a time."""

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        """Open the journal of the run with this identity, or begin it.

        Raises:
            UsageError: another process is writing it.
            DataError: the file is no journal, or that of another run.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._file: BinaryIO = path.open("a+b")
        try:
            self._lock()
            records, notes = self._recover(identity)
            self._records = {record.key: record for record in records}
            self._notes = {note.fingerprint: note for note in notes}
        except (DataError, UsageError):
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def records(self) -> list[UnitRecord]:
        """Everything recorded, the latest of a unit where it was tried again."""
        return list(self._records.values())

    def answered(self, key: tuple[str, str, str], fingerprint: str) -> UnitRecord | None:
        """The record of a unit that was answered from these inputs; a failed one is tried again by the next run."""
        record = self._records.get(key)
        if record is None or record.failure is not None or record.fingerprint != fingerprint:
            return None
        return record

    def append(self, record: UnitRecord) -> None:
        """Record a unit; it is on disk when this returns."""
        self._write(msgspec.json.encode(record))
        self._records[record.key] = record

    def note(self, fingerprint: str) -> NoteRecord | None:
        """The note that was taken from these inputs, if one was."""
        return self._notes.get(fingerprint)

    def append_note(self, record: NoteRecord) -> None:
        """Record a note; it is on disk when this returns."""
        self._write(msgspec.json.encode(record))
        self._notes[record.fingerprint] = record

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise UsageError(f"{self.path}: another run is writing it; wait for it or stop it") from error

    def _recover(self, identity: Mapping[str, Any]) -> tuple[list[UnitRecord], list[NoteRecord]]:
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            self._file.truncate(whole)
        if not whole:
            self._write(msgspec.json.encode(_Header(_FORMAT, dict(identity))))
            return [], []
        header, records, notes = _decode(content[:whole], self.path)
        if canonical_json(header.identity) != canonical_json(identity):
            raise DataError(f"{self.path}: is the journal of another run; give another --output")
        return records, notes

    def _write(self, line: bytes) -> None:
        self._file.write(line + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())


def read_journal(path: Path) -> tuple[dict[str, Any], list[UnitRecord]]:
    """The identity of a run and its records, the latest of each unit.

    Raises:
        DataError: the file cannot be read or is no journal.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    header, records, _ = _decode(content[: content.rfind(b"\n") + 1], path)
    return header.identity, list({record.key: record for record in records}.values())


def _decode(content: bytes, path: Path) -> tuple[_Header, list[UnitRecord], list[NoteRecord]]:
    lines = content.splitlines()
    number = 1
    try:
        header = msgspec.json.decode(lines[0] if lines else b"", type=_Header)
        records: list[UnitRecord] = []
        notes: list[NoteRecord] = []
        for number, line in enumerate(lines[1:], 2):  # noqa: B007 - the number is for the error
            if line.startswith(_NOTE):
                notes.append(msgspec.json.decode(line, type=NoteRecord))
            else:
                records.append(msgspec.json.decode(line, type=UnitRecord))
    except (msgspec.DecodeError, msgspec.ValidationError) as error:
        raise DataError(f"{path}, line {number}: not a line of a journal ({error}); take it away") from error
    if header.format != _FORMAT:
        raise DataError(f"{path}: format {header.format} of another version of infthor-eval; start anew")
    return header, records, notes
