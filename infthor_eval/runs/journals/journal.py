"""The journal of a run: every finished unit, one JSON line each, on disk before it counts.

A journal is a folder of shards, which are read together. A shard belongs to one worker: number 0 to
the driver, the others to the workers of a pool. Only its owner writes it, and holds a lock on it
while it does, so a line needs no coordination with other processes, and a second run in the same
folder is refused. The first line of each shard is the run's header.

A record is looked up by its unit's key, and counts only if the fingerprint of the unit's inputs is
the same, so a result from other inputs is never used. A line that a killed process left unfinished
is cut off when its shard is opened again.
"""

import fcntl
import itertools
import os
import time
from collections.abc import Iterable
from contextlib import ExitStack
from io import FileIO
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, Generic, Self

import msgspec

from infthor_eval.errors import DataError, UsageError, in_one_line, wrap_errors
from infthor_eval.formats.reading import NOT_JSON, require_file
from infthor_eval.runs.journals.record_encoder import RecordEncoder
from infthor_eval.runs.journals.records import (
    Artifact,
    ArtifactRecord,
    Payload,
    RecordTypes,
    RunHeader,
    Unit,
    UnitKey,
    UnitRecord,
    describe_failure,
)
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.journals.shards import (
    FOLDER,
    Decoder,
    RunLog,
    check_format,
    find_shards,
    is_of_run,
    read_lines,
    read_shard,
    read_shards,
)
from infthor_eval.runs.journals.tracebacks import TracebackFile
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.storage.files import write_atomically, writing_hint
from infthor_eval.storage.limits import FILE_MB

_SHARD = "worker-{:d}.jsonl"
_MB = 2**20
_RETRY_S = 0.1  # between two attempts to lock
_BAD_LINES = "bad_lines.txt"


class Journal(Generic[Payload]):
    """Append-only record of one run, in a folder of shards; this process holds one of them.

    It is the `Session` of the suite whose results go to it.
    """

    def __init__(
        self,
        run: Path,
        header: RunHeader,
        types: RecordTypes[Payload],
        worker: int = 0,
        wait_s: float = 0.0,
    ) -> None:
        """Open or create a worker's shard in the run's folder, and read all others.

        Another process has `wait_s` seconds to release the shard.
        """
        path = run / FOLDER / _SHARD.format(worker)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.exists():
                require_file(path, "take it out of the run's folder")
            # Unbuffered: bytes that a full disk refused must not be written later, when the file is
            # closed.
            self._file: FileIO = path.open("a+b", buffering=0)
        except OSError as error:
            raise UsageError(
                f"{path}: cannot be written ({in_one_line(error)}); give another --out"
            ) from error
        self._path = path
        self.header = header
        self.folder = path.parent
        self._tracebacks = TracebackFile(self.folder)
        self._writing = Lock()
        try:
            _lock(self._file, path, wait_s)
            self._types = types
            self._encoder = RecordEncoder(types)
            self._log: RunLog[Payload] = read_shards(run, types)
            self._start_shard()
        except (DataError, UsageError):
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    @property
    def records(self) -> list[UnitRecord[Payload]]:
        """The latest record of each unit in all shards."""
        return self._log.records

    def find_record(self, unit: Unit[Payload], fingerprint: str) -> UnitRecord[Payload] | None:
        """See `Session`; a unit that failed is tried again by the next run."""
        record = self._log.units.get(unit.key)
        if record is None or record.failure is not None or record.fingerprint != fingerprint:
            return None
        return record

    def describe_failure(self, unit: Unit[Payload], error: BaseException) -> str:
        """See `Session`."""
        earlier = self._log.units.get(unit.key)
        attempt = 1 if earlier is None else earlier.attempt + 1
        file = self._tracebacks.append(unit.key, attempt, error)
        return describe_failure(error) + (f"; traceback in {file}" if file else "")

    def latest_records(self, keys: Iterable[UnitKey]) -> tuple[UnitRecord[Payload], ...]:
        """Return these units' latest records, failed ones included; some may have none."""
        return tuple(self._log.units[key] for key in keys if key in self._log.units)

    def add(self, record: UnitRecord[Payload]) -> None:
        """Add a record that is in another shard to what this process knows."""
        self._log.add(record)

    def add_from(
        self, worker: int, record: UnitRecord[Payload], request: StoredRequest | None
    ) -> None:
        """Add a worker's record; where its shard is not visible here, write it into this one.

        Args:
            worker: number of the worker.
            record: the record.
            request: the request that it names, if no record before it did.
        """
        if not (self._path.parent / _SHARD.format(worker)).exists():
            if request is not None:
                self.cache_artifact(record.request, request)
            self._write(record)
        self.add(record)

    def reread(self, worker: int) -> None:
        """Read the shard of another worker, for records that it wrote but did not send."""
        path = self._path.parent / _SHARD.format(worker)
        if path.exists():
            read_shard(path, self._types, self._log)

    def append_new(self, record: UnitRecord[Payload]) -> tuple[UnitRecord[Payload], bool]:
        """Put a suite's record on disk unless it is there; return it, and True if it was there.

        One whose unit already has a result from other inputs gets a fault that says so.
        """
        earlier = self._log.units.get(record.key)
        if earlier is record:  # found here, and yielded as it is
            return record, True
        if (
            earlier is not None
            and earlier.failure is None
            and record.fingerprint not in ("", earlier.fingerprint)
        ):
            changed = (
                f"its inputs changed since attempt {earlier.attempt}: a frame, a text or a "
                "trajectory is another now"
            )
            record = msgspec.structs.replace(record, faults=(*record.faults, changed))
        return self.append(record), False

    def append(self, record: UnitRecord[Payload]) -> UnitRecord[Payload]:
        """Write a record to disk before returning it with the number of its attempt."""
        self.check_file()
        earlier = self._log.units.get(record.key)
        if earlier is not None:
            record = msgspec.structs.replace(record, attempt=earlier.attempt + 1)
        self._write(record)
        self._log.add(record)
        return record

    def find_artifact(self, fingerprint: str, kind: type[Artifact]) -> Artifact | None:
        """See `Session`."""
        return self._log.find_artifact(fingerprint, kind)

    @property
    def artifacts(self) -> list[ArtifactRecord[Any]]:
        """The cached artifacts of all shards, in the order of their fingerprints."""
        return [self._log.artifacts[key] for key in sorted(self._log.artifacts)]

    def cache_artifact(self, fingerprint: str, artifact: Any, usage: Usage = NOTHING) -> None:
        """See `Session`; it is on disk when this returns."""
        record: ArtifactRecord[Any] = ArtifactRecord(
            fingerprint=fingerprint, payload=artifact, usage=usage
        )
        self._write(record)
        self._log.add(record)

    def _start_shard(self) -> None:
        """Check the run, cut off an unfinished line, and write the header if there is none."""
        other = self._log.header
        if other is not None and other.config != self.header.config:
            raise DataError(f"{self.folder}: is the journal of another run; give another --out")
        content = self._path.read_bytes()
        end = content.rfind(b"\n") + 1
        if end < len(content):  # or the next line would continue it, and be bad too
            self._file.truncate(end)
        if not end:
            self._write(self.header)

    def _write(self, record: msgspec.Struct) -> None:
        line = memoryview(self._encoder.encode(record) + b"\n")
        if os.fstat(self._file.fileno()).st_size + len(line) > FILE_MB.value * _MB:
            raise DataError(f"{self._path}: holds {FILE_MB.value} MiB, the most; {FILE_MB.hint}")
        hint = writing_hint(" and run the same command again, which resumes it")
        # Threads must not mix their lines.
        with self._writing, wrap_errors(f"{self._path}: cannot be written", hint):
            while line:  # an unbuffered write may take a part of the line only
                line = line[self._file.write(line) :]
            # Before the record counts: after a crash of the machine a unit is done if and only if
            # its line is there.
            os.fsync(self._file.fileno())

    def check_file(self) -> None:
        """Check that the shard is still at its path: what is written to a deleted file is lost."""
        try:
            is_same = os.path.samestat(self._path.stat(), os.fstat(self._file.fileno()))
        except OSError:
            is_same = False
        if not is_same:
            raise DataError(
                f"{self._path}: was deleted or replaced while the run wrote it; run the same "
                "command again"
            )


def _lock(file: BinaryIO | FileIO, path: Path, wait_s: float = 0.0) -> None:
    end = time.monotonic() + wait_s
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError as error:
            if time.monotonic() >= end:
                raise UsageError(
                    f"{path}: another run is writing it; wait for it or stop it"
                ) from error
        time.sleep(_RETRY_S)


def recover(run: Path, header: RunHeader, types: RecordTypes[Any]) -> int:
    """Move the bad lines of a run's shards to a file beside them: their units are tried again.

    The header replaces a bad first line. Returns the number of bad lines.
    """
    return sum(_recover_shard(path, header, types) for path in find_shards(run))


def _recover_shard(path: Path, header: RunHeader, types: RecordTypes[Any]) -> int:
    with path.open("rb") as file:
        _lock(file, path)
        decoder = types.decoder()
        bad: list[bytes] = []
        good: list[bytes] = []
        lines = read_lines(path)
        check_format(path, lines[0] if lines else b"")
        for number, line in enumerate(lines):
            (good if _is_good(line, decoder, header, number == 0) else bad).append(line)
        if not bad:
            return 0
        if not (good and isinstance(decoder.decode(good[0]), RunHeader)):
            good.insert(0, RecordEncoder(types).encode(header))
        # The bad lines first: a crash between the two leaves them twice, not lost.
        with (path.parent / _BAD_LINES).open("ab") as file_of_bad:
            file_of_bad.write(b"".join(line + b"\n" for line in bad))
        with write_atomically(path) as partial:
            partial.write_bytes(b"".join(line + b"\n" for line in good))
        return len(bad)


def _is_good(line: bytes, decoder: Decoder, header: RunHeader, is_first: bool) -> bool:
    try:
        record = decoder.decode(line)
    except NOT_JSON:
        return False
    return isinstance(record, RunHeader) == is_first and is_of_run(record, header)


def set_aside(run: Path) -> None:
    """Rename the journal of a run, so that the run restarts and nothing is lost."""
    if not (run / FOLDER).exists():
        return
    with ExitStack() as locks:  # of all shards, until the folder has its new name
        for path in find_shards(run):
            _lock(locks.enter_context(path.open("rb")), path)
        number = next(n for n in itertools.count(1) if not (run / f"{FOLDER}.{n}").exists())
        (run / FOLDER).rename(run / f"{FOLDER}.{number}")
