"""Reading the journal of a run while it goes on, without locks or writes that it would notice."""

import os
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from infthor_eval.errors import DataError
from infthor_eval.runs.journals.records import RunHeader, UnitRecord
from infthor_eval.runs.journals.shards import (
    Decoder,
    RunLog,
    find_shards,
    parse_header,
    parse_record,
)
from infthor_eval.runs.suite import Suite

_LOCKS = Path("/proc/locks")  # Linux has it


class _Position(NamedTuple):
    """How far a shard has been read: which file it was, its bytes and its lines."""

    file: tuple[int, int]
    n_bytes: int
    n_lines: int


class FollowedJournal:
    """A journal that grows; only what is new is read each time.

    Attributes:
        suite: suite of the run; None before the header is there.
        log: what has been read.
        newest: the last records that were read, the newest last.
        bad_lines: a message for each bad line, which is left out.
    """

    def __init__(
        self, run: Path, find_suite: Callable[[str], Suite[Any, Any]], n_newest: int
    ) -> None:
        """Read nothing yet.

        Args:
            run: folder of the run.
            find_suite: returns the suite of a name.
            n_newest: number of records to keep in `newest`.
        """
        self._run = run
        self._find_suite = find_suite
        self._newest = n_newest
        self._start()

    def _start(self) -> None:
        self.suite: Suite[Any, Any] | None = None
        self.log: RunLog[Any] = RunLog()
        self.newest: deque[UnitRecord[Any]] = deque(maxlen=self._newest)
        self.bad_lines: list[str] = []
        self._decoder: Decoder | None = None
        self._positions: dict[Path, _Position] = {}

    @property
    def header(self) -> RunHeader | None:
        """Header of the run; None if it is not there yet."""
        return self.log.header

    def read(self) -> bool:
        """Read what is new; return whether there was any. A line without its end is left for later.

        Raises:
            DataError: the first line of a shard is no header.
            OSError: a shard cannot be read, or was moved away meanwhile.
            UsageError: the suite of the run is not known here.
        """
        # The shard that was written last comes last, so that its records are the newest.
        shards = sorted(find_shards(self._run), key=lambda path: path.stat().st_mtime)
        files = {path: _file_and_size(path) for path in shards}
        if any(self._is_another(path, *files.get(path, ((0, 0), 0))) for path in self._positions):
            self._start()  # set aside by --fresh, or written again by --recover
        grown = [self._read_shard(path, *files[path]) for path in shards]
        return any(grown)

    def _is_another(self, path: Path, file: tuple[int, int], size: int) -> bool:
        known = self._positions[path]
        return file != known.file or size < known.n_bytes

    def _read_shard(self, path: Path, file: tuple[int, int], size: int) -> bool:
        position = self._positions.get(path, _Position(file, 0, 0))
        if size == position.n_bytes:
            return False
        with path.open("rb") as opened:
            opened.seek(position.n_bytes)
            content = opened.read()
        whole = content[: content.rfind(b"\n") + 1]
        for number, line in enumerate(whole.split(b"\n")[:-1], position.n_lines + 1):
            self._add_line(path, number, line)
            position = _Position(file, position.n_bytes + len(line) + 1, number)
            self._positions[path] = position
        return bool(whole)

    def _add_line(self, path: Path, number: int, line: bytes) -> None:
        if number == 1:
            self.suite = self._find_suite(parse_header(path, line).suite)
            self._decoder = self.suite.records.decoder()
            self.log.header = parse_header(path, line, self.suite.records)
        assert self._decoder is not None  # the first line of a shard is its header
        if number > 1:
            try:
                assert self.log.header is not None
                record = parse_record(path, number, line, self._decoder, self.log.header)
            except DataError as error:
                self.bad_lines.append(str(error))
                return
            self.log.add(record)
            if isinstance(record, UnitRecord):
                self.newest.append(record)


def is_written(run: Path) -> bool | None:
    """Return whether a process here holds a journal, as a run does; None if that is not known.

    The system's list of locks is read: to try a lock would be to hold it for a moment, and a run
    that starts in that moment would be refused.

    Raises:
        OSError: a shard was moved away meanwhile.
    """
    if not _LOCKS.is_file():
        return None
    held = {
        tuple(line.split()[5].split(":"))
        for line in _LOCKS.read_text().splitlines()
        if " FLOCK " in line
    }
    return any(_lock_name(path) in held for path in find_shards(run))


def _lock_name(path: Path) -> tuple[str, str, str]:
    """Return device and inode of a file as the list of locks has them."""
    status = path.stat()
    return f"{os.major(status.st_dev):02x}", f"{os.minor(status.st_dev):02x}", str(status.st_ino)


def _file_and_size(path: Path) -> tuple[tuple[int, int], int]:
    status = path.stat()
    return (status.st_dev, status.st_ino), status.st_size
