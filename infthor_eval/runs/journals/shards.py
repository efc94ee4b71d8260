"""Reading the shards of a run's journal."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import Any, Generic

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.reading import NOT_JSON, read_bytes, require_file
from infthor_eval.runs.journals.records import (
    FORMAT,
    Artifact,
    ArtifactRecord,
    Payload,
    RecordTypes,
    RunHeader,
    State,
    UnitKey,
    UnitRecord,
    state_of,
)
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.usage import Usage

FOLDER = "journal"  # within the run's folder
Decoder = msgspec.json.Decoder[Any]
# Called with a message for each bad line of a journal, which is then left out.
Notify = Callable[[str], None]
_FORMAT_1 = "journal.jsonl"  # the single file of format 1, in the run's folder
_HINT = (
    "run the same command with --recover to resume without such lines, or with --fresh to restart"
)


@dataclass
class RunLog(Generic[Payload]):
    """The contents of all shards: latest records of units, and artifacts by fingerprint."""

    header: RunHeader | None = None
    units: dict[UnitKey, UnitRecord[Payload]] = field(default_factory=dict)
    artifacts: dict[str, ArtifactRecord[Any]] = field(default_factory=dict)

    def add(self, record: UnitRecord[Payload] | ArtifactRecord[Any]) -> None:
        """Add a record: a unit's last attempt counts; of one attempt by two workers, the result."""
        if isinstance(record, ArtifactRecord):
            self.artifacts[record.fingerprint] = record
            return
        known = self.units.get(record.key)
        if known is None or _rank(record) >= _rank(known):
            self.units[record.key] = record

    @property
    def records(self) -> list[UnitRecord[Payload]]:
        """The latest record of each unit, in the order of the units' keys."""
        return [self.units[key] for key in sorted(self.units)]

    def find_artifact(self, fingerprint: str, kind: type[Artifact]) -> Artifact | None:
        """Return the cached artifact of these inputs, or None."""
        record = self.artifacts.get(fingerprint)
        return record.payload if record is not None and isinstance(record.payload, kind) else None

    @property
    def requests(self) -> dict[str, StoredRequest]:
        """The stored requests by the names that records have for them."""
        payloads = {name: record.payload for name, record in self.artifacts.items()}
        return {name: it for name, it in payloads.items() if isinstance(it, StoredRequest)}

    def requests_before(self, name: str) -> list[StoredRequest] | None:
        """Return the requests that one continues, the first one first, and itself; None where one
        of them is missing."""
        chain: list[StoredRequest] = []
        names = {""}
        while name not in names:  # what a stranger wrote may lead in a circle
            names.add(name)
            request = self.find_artifact(name, StoredRequest)
            if request is None:
                return None
            chain.insert(0, request)
            name = request.after
        return chain or None

    @property
    def usage(self) -> Usage:
        """Usage of all requests, those for cached artifacts included."""
        return Usage.total(
            [
                *(unit.usage for unit in self.units.values()),
                *(artifact.usage for artifact in self.artifacts.values()),
            ]
        )


def _rank(record: "UnitRecord[Any] | _UnitOutcome") -> tuple[int, bool]:
    return record.attempt, record.failure is None


def read_header(run: Path) -> RunHeader:
    """Read the header of the run in a folder.

    Raises:
        DataError: there is no journal, or one of another format.
    """
    shards = find_shards(run)
    if shards:
        return parse_header(shards[0], next(iter(read_lines(shards[0])), b""))
    if (run / _FORMAT_1).is_file():
        raise DataError(
            f"{run}: its journal is of format 1, this version reads {FORMAT}; run the evaluation "
            "again"
        )
    if not run.exists():
        raise DataError(f"{run}: no such folder; `infthor-eval ls runs` lists the runs of a folder")
    below = next(chain(run.glob(f"*/{FOLDER}"), run.glob(f"*/*/{FOLDER}")), None)
    such_as = "" if below is None else f", such as {below.parent}"
    raise DataError(f"{run}: no journal in it; give the folder of a run{such_as}")


def read_run(
    run: Path, types: RecordTypes[Payload], notify: Notify | None = None
) -> tuple[RunHeader, list[UnitRecord[Payload]]]:
    """Read the header of the run in a folder, and the latest record of each unit of all shards.

    Args:
        run: the folder.
        types: types of the suite's records.
        notify: called with each bad line, which is left out; None to refuse a journal that has one.

    Raises:
        DataError: there is no journal, or one with a bad line, of another format or suite.
    """
    header, log = read_run_log(run, types, notify)
    return header, log.records


def read_run_log(
    run: Path, types: RecordTypes[Payload], notify: Notify | None = None
) -> tuple[RunHeader, RunLog[Payload]]:
    """Read the header of the run in a folder, and the contents of all its shards; see
    `read_run`."""
    any_header = read_header(run)  # or says that there is no journal
    log = read_shards(run, types, notify)
    return log.header or any_header, log


class _UnitOutcome(msgspec.Struct, tag_field="type", tag="unit"):
    """The fields of a unit's record that need no suite."""

    task: str
    id: str
    variant: str = ""
    repeat: int = 1
    attempt: int = 1
    failure: str | None = None
    asked: bool = True
    excluded: str | None = None

    @property
    def state(self) -> State:
        """See `UnitRecord.state`."""
        return state_of(self.failure, self.excluded, asked=self.asked)


class _AnyArtifact(msgspec.Struct, tag_field="type", tag="artifact"):
    """An artifact; no field of it is read."""


class _AnyHeader(msgspec.Struct, tag_field="type", tag="run"):
    """A header; no field of it is read."""


def read_states(run: Path, notify: Notify | None = None) -> dict[UnitKey, State]:
    """Return the state of each unit with a record, by its latest attempt; needs no suite.

    Args:
        run: the folder.
        notify: see `read_run`.
    """
    decoder = msgspec.json.Decoder(_UnitOutcome | _AnyArtifact | _AnyHeader)
    latest: dict[UnitKey, _UnitOutcome] = {}
    for path in find_shards(run):
        for number, line in enumerate(read_lines(path), 1):
            with _notifying(notify), _naming(path, number):
                unit = decoder.decode(line)
                if not isinstance(unit, _UnitOutcome):
                    continue
                key = UnitKey(unit.task, unit.id, unit.variant, unit.repeat)
                known = latest.get(key)
                if known is None or _rank(unit) >= _rank(known):
                    latest[key] = unit
    return {key: unit.state for key, unit in latest.items()}


def find_shards(run: Path) -> list[Path]:
    """Return the files of a run's shards."""
    shards = sorted((run / FOLDER).glob("worker-*.jsonl"))
    for path in shards:
        require_file(path, "take it out of the run's folder")
    return shards


def last_change(folder: Path) -> datetime:
    """Return when the last unit of the run in a folder was done, by its journal.

    Exports take it as their own time, so that those of one run are equal.
    """
    changed = max(shard.stat().st_mtime for shard in find_shards(folder))
    return datetime.fromtimestamp(changed, UTC)


def read_shards(
    run: Path, types: RecordTypes[Payload], notify: Notify | None = None
) -> RunLog[Payload]:
    """Read all shards of a run, see `read_run`; an empty log if there is none."""
    log: RunLog[Payload] = RunLog()
    for path in find_shards(run):
        read_shard(path, types, log, notify)
    return log


def read_shard(
    path: Path, types: RecordTypes[Payload], log: RunLog[Payload], notify: Notify | None = None
) -> None:
    """Add the contents of a shard to a log, see `read_run`."""
    lines = read_lines(path)
    if not lines:
        return  # created by a worker that was killed before it wrote the header
    header = parse_header(path, lines[0], types)
    if log.header is not None and header.config != log.header.config:
        raise DataError(
            f"{path}: belongs to another run than the shards beside it; take it out of the folder"
        )
    log.header = header
    decoder = types.decoder()
    for number, line in enumerate(lines[1:], 2):
        with _notifying(notify):
            log.add(parse_record(path, number, line, decoder, header))


@contextmanager
def _notifying(notify: Notify | None) -> Iterator[None]:
    """Notify of a bad line instead of raising its error, if `notify` is given."""
    try:
        yield
    except DataError as error:
        if notify is None:
            raise
        notify(f"left out: {error}")


def _naming(path: Path, number: int) -> AbstractContextManager[None]:
    return wrap_errors(f"{path}, line {number}: not a line of a journal", _HINT, catch=NOT_JSON)


def parse_record(
    path: Path, number: int, line: bytes, decoder: Decoder, header: RunHeader[Any]
) -> UnitRecord[Any] | ArtifactRecord[Any]:
    """Return the record in a line of a shard; `number` is the line's, from 1."""
    with _naming(path, number):
        record: UnitRecord[Any] | ArtifactRecord[Any] | RunHeader = decoder.decode(line)
    if isinstance(record, RunHeader):
        raise DataError(
            f"{path}, line {number}: a second header in the middle of the records; {_HINT}"
        )
    if not is_of_run(record, header):
        raise DataError(f"{path}, line {number}: of a task that the run's header lacks; {_HINT}")
    return record


def is_of_run(record: Any, header: RunHeader[Any]) -> bool:
    """Return whether a record is of a task of the run; that of another harness's requests names
    none in its header."""
    tasks = header.config.tasks
    return not isinstance(record, UnitRecord) or not tasks or record.task in tasks


def read_lines(path: Path) -> list[bytes]:
    """Return a shard's complete lines: a last one without its end may still be being written."""
    content = read_bytes(path, "restore the file")
    return content[: content.rfind(b"\n") + 1].splitlines()


class _AnyFormat(msgspec.Struct):
    format: int


def check_format(path: Path, line: bytes) -> None:
    """Refuse a shard whose first line is a header of another format; any other line passes."""
    try:
        version = msgspec.json.decode(line, type=_AnyFormat).format
    except NOT_JSON:
        return
    if version != FORMAT:
        raise DataError(
            f"{path}: a journal of format {version}, this version reads {FORMAT}; run the command "
            "again with --fresh"
        )


_ANY_SUITE: RecordTypes[Any] = RecordTypes(unit=Any)  # configs of tasks as JSON values


def parse_header(path: Path, line: bytes, types: RecordTypes[Any] | None = None) -> RunHeader[Any]:
    """Return the header in the first line of a shard; with the config of a suite given its
    types."""
    check_format(path, line)
    with wrap_errors(f"{path}, line 1: not the first line of a journal", _HINT, catch=NOT_JSON):
        header = _ANY_SUITE.header_decoder().decode(line)
    if types is None:
        return header
    problem = f"{path}, line 1: not the config of a run of {header.suite}"
    with wrap_errors(problem, "run the evaluation again", catch=msgspec.ValidationError):
        return types.header_decoder().decode(line)
