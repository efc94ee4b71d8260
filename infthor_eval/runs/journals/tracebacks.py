"""Tracebacks of exceptions in adapters and suites, in a text file beside the journal's shards."""

import re
import traceback
from collections.abc import Mapping
from pathlib import Path
from threading import Lock

from infthor_eval.errors import InfthorError, UserCodeError
from infthor_eval.formats.reading import read_bytes
from infthor_eval.runs.journals.records import UnitKey

_NAME = "tracebacks.txt"
_HEADING = re.compile(r"^== (.+, attempt \d+)$", re.MULTILINE)  # each unit's
_SAME = "as for "  # before the unit whose traceback it is
_HINT = "restore the file, or remove it: tracebacks are missing then"


def _name(key: UnitKey, attempt: int) -> str:
    return f"{key.task}: {key}, attempt {attempt}"


class TracebackFile:
    """The tracebacks of a run; each process appends to the file."""

    def __init__(self, journal: Path) -> None:
        """Take the journal's folder; the file is created with the first traceback."""
        self._path = journal / _NAME
        self._units: dict[str, str] = {}  # traceback to the first unit that has it
        self._lock = Lock()

    def append(self, key: UnitKey, attempt: int, error: BaseException) -> str:
        """Append the traceback of an unexpected exception, or of a `UserCodeError`'s cause.

        Returns:
            Name of the file within the run's folder; empty for an expected error, which needs no
            traceback.
        """
        exception = error.__cause__ if isinstance(error, UserCodeError) else error
        if exception is None or isinstance(exception, InfthorError):
            return ""
        text = "".join(traceback.format_exception(exception))
        unit = _name(key, attempt)
        with self._lock:
            first = self._units.setdefault(text, unit)
            # The same fault often fails every unit: its traceback is written once.
            entry = text if first == unit else f"{_SAME}{first}\n"
            # One write in append mode: workers share the file, and must not interleave.
            with self._path.open("ab", buffering=0) as file:
                file.write(f"== {unit}\n{entry}\n".encode("utf-8", "backslashreplace"))
        return f"{self._path.parent.name}/{_NAME}"


class StoredTracebacks:
    """The tracebacks of a stored run."""

    def __init__(self, journal: Path) -> None:
        """Read the file in the journal's folder; a run without one has none."""
        path = journal / _NAME
        # A process that was killed can have left half a character.
        text = read_bytes(path, _HINT).decode("utf-8", "replace") if path.exists() else ""
        _, *parts = _HEADING.split(text)
        self._by_unit: Mapping[str, str] = {
            unit: part.strip("\n") for unit, part in zip(parts[::2], parts[1::2], strict=True)
        }

    def find(self, key: UnitKey, attempt: int) -> str:
        """Return the traceback of a unit's attempt; empty if it has none."""
        text = self._by_unit.get(_name(key, attempt), "")
        return self._by_unit.get(text.removeprefix(_SAME), "") if text.startswith(_SAME) else text
