"""The shards of a run's journal, read: who the run is, and what they hold together."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.digests import canonical_json
from infthor_eval.formats.reading import read_bytes, require_file
from infthor_eval.runs.records import FORMAT, ArtifactRecord, RecordTypes, RunHeader, UnitKey, UnitRecord
from infthor_eval.runs.usage import Usage

__all__ = [
    "BAD",
    "FOLDER",
    "Decoder",
    "RunLog",
    "latest_outcomes",
    "lines_in",
    "read_header",
    "read_run",
    "read_shard",
    "read_shards",
    "shards_of",
]

FOLDER = "journal"  # of a run's folder
Decoder = msgspec.json.Decoder[Any]
BAD = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)  # what a line is that is none of a journal
_OLD = "journal.jsonl"  # the one file of format 1, in the run's folder
_MEND = "run the same command with --recover to go on without such lines, or with --fresh to start anew"


@dataclass
class RunLog:
    """What the shards of a run hold together.

    Attributes:
        header: who the run is; None where there is no shard yet.
        units: the latest record of each unit.
        artifacts: cached artifacts by fingerprint.
    """

    header: RunHeader | None = None
    units: dict[UnitKey, UnitRecord[Any]] = field(default_factory=dict)
    artifacts: dict[str, ArtifactRecord[Any]] = field(default_factory=dict)

    def add(self, record: UnitRecord[Any] | ArtifactRecord[Any]) -> None:
        """Take up a record; of a unit that was tried several times the last try counts, and of two the successful."""
        if isinstance(record, ArtifactRecord):
            self.artifacts[record.fingerprint] = record
            return
        known = self.units.get(record.key)
        if known is None or _rank(record) >= _rank(known):
            self.units[record.key] = record

    @property
    def records(self) -> list[UnitRecord[Any]]:
        """The latest record of each unit, in the order of the units' keys."""
        return [self.units[key] for key in sorted(self.units)]

    @property
    def usage(self) -> Usage:
        """What all requests took, those for cached artifacts included."""
        return Usage.total(
            [*(unit.usage for unit in self.units.values()), *(artifact.usage for artifact in self.artifacts.values())]
        )


def _rank(record: UnitRecord[Any]) -> tuple[int, bool]:
    return record.attempt, record.failure is None


def read_header(run: Path) -> RunHeader:
    """Who the run in a folder is.

    Raises:
        DataError: there is no journal, or of another format.
    """
    shards = shards_of(run)
    if not shards:
        raise DataError(f"{run}: {_no_journal(run)}")
    return _header(shards[0], lines_in(shards[0]))


def read_run(run: Path, types: RecordTypes) -> tuple[RunHeader, list[UnitRecord[Any]]]:
    """The run in a folder: who it is, and the latest record of each unit of all shards.

    Raises:
        DataError: there is no journal, or one with a bad line, or of another format.
    """
    header = read_header(run)
    return header, read_shards(run, types.decoder()).records


class _Outcome(msgspec.Struct, tag_field="type", tag="unit"):
    """What is looked at of a unit where its suite is not known."""

    task: str
    id: str
    variant: str = ""
    attempt: int = 1
    failure: str | None = None


class _Artifact(msgspec.Struct, tag_field="type", tag="artifact"):
    """Nothing is looked at."""


def latest_outcomes(run: Path) -> dict[UnitKey, bool]:
    """Whether each unit that has a record failed, whatever suite it is of.

    Raises:
        DataError: a line is bad.
    """
    decoder = msgspec.json.Decoder(_Outcome | _Artifact | RunHeader)
    found: dict[UnitKey, tuple[int, bool]] = {}
    for path in shards_of(run):
        for number, line in enumerate(lines_in(path), 1):
            try:
                unit = decoder.decode(line)
            except BAD as error:
                raise DataError(f"{path}, line {number}: not a line of a journal ({error}); {_MEND}") from error
            if isinstance(unit, _Outcome):
                key, rank = UnitKey(unit.task, unit.id, unit.variant), (unit.attempt, unit.failure is None)
                found[key] = max(found.get(key, rank), rank)
    return {key: not succeeded for key, (_, succeeded) in found.items()}


def _no_journal(run: Path) -> str:
    if (run / _OLD).is_file():
        return f"its journal is of format 1, this version reads {FORMAT}; run the evaluation again"
    return "no journal in it; give the folder of a run"


def shards_of(run: Path) -> list[Path]:
    """The files of a run's shards.

    Raises:
        DataError: one of them is no file.
    """
    shards = sorted((run / FOLDER).glob("worker-*.jsonl"))
    for path in shards:
        require_file(path, "take it out of the run's folder")
    return shards


def read_shards(run: Path, decoder: Decoder) -> RunLog:
    """All that the shards of a run hold together; nothing where there is none.

    Raises:
        DataError: a shard has a bad line, is of another format, or of another run than the others.
    """
    log = RunLog()
    for path in shards_of(run):
        read_shard(path, decoder, log)
    return log


def read_shard(path: Path, decoder: Decoder, log: RunLog) -> None:
    """Take up all that a shard holds."""
    lines = lines_in(path)
    if not lines:
        return  # begun by a worker that was killed before it said who it is
    header = _header(path, lines)
    if log.header is not None and canonical_json(header.config) != canonical_json(log.header.config):
        raise DataError(f"{path}: belongs to another run than the shards beside it; take it out of the folder")
    log.header = header
    for number, line in enumerate(lines[1:], 2):
        try:
            record = decoder.decode(line)
        except BAD as error:
            raise DataError(f"{path}, line {number}: not a line of a journal ({error}); {_MEND}") from error
        if isinstance(record, RunHeader):
            raise DataError(f"{path}, line {number}: the first line of a journal amid its records; {_MEND}")
        log.add(record)


def lines_in(path: Path) -> list[bytes]:
    """The whole lines of a shard; one that is not finished is none yet."""
    content = read_bytes(path, "restore the file")
    return content[: content.rfind(b"\n") + 1].splitlines()


class _AnyFormat(msgspec.Struct):
    format: int


def _header(path: Path, lines: list[bytes]) -> RunHeader:
    first = lines[0] if lines else b""
    try:
        version = msgspec.json.decode(first, type=_AnyFormat).format
    except BAD as error:
        raise DataError(f"{path}, line 1: not the first line of a journal ({error}); {_MEND}") from error
    if version != FORMAT:
        raise DataError(
            f"{path}: a journal of format {version}, this version reads {FORMAT}; run the command again with --fresh"
        )
    try:
        return msgspec.json.decode(first, type=RunHeader)
    except BAD as error:
        raise DataError(f"{path}, line 1: not the first line of a journal ({error}); {_MEND}") from error
