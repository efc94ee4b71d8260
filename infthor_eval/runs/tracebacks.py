"""Tracebacks of exceptions in adapters and suites, in a text file beside the shards of the journal."""

import traceback
from pathlib import Path
from threading import Lock

from infthor_eval.errors import InfthorError, UserCodeError
from infthor_eval.runs.records import UnitKey

__all__ = ["TracebackFile"]

_NAME = "tracebacks.txt"


class TracebackFile:
    """The tracebacks of a run; each process appends to the file."""

    def __init__(self, journal: Path) -> None:
        """Take the journal's folder; the file is created with the first traceback."""
        self._path = journal / _NAME
        self._units: dict[str, str] = {}  # traceback to the first unit that has it
        self._lock = Lock()

    def append(self, key: UnitKey, attempt: int, error: Exception) -> str:
        """Append the traceback of an unexpected exception, or of the cause of a `UserCodeError`, that failed a unit.

        Returns:
            Name of the file within the run's folder; empty for an expected error, which needs no traceback.
        """
        exception = error.__cause__ if isinstance(error, UserCodeError) else error
        if exception is None or isinstance(exception, InfthorError):
            return ""
        text = "".join(traceback.format_exception(exception))
        unit = f"{key.task}: {key}, attempt {attempt}"
        with self._lock:
            first = self._units.setdefault(text, unit)
            # The same fault often fails every unit: its traceback is written once.
            shown = text if first == unit else f"as for {first}\n"
            # One write in append mode: workers share the file, and must not interleave.
            with self._path.open("ab", buffering=0) as file:
                file.write(f"== {unit}\n{shown}\n".encode())
        return f"{self._path.parent.name}/{_NAME}"
