"""What is known of a reader: a sound input, and what must hold however it is damaged."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from infthor_eval.errors import InfthorError
from infthor_sim.errors import SimulatorError

from .damage import Form

__all__ = ["Reader", "TooSlowError"]

_SECONDS = 10  # of the processor, for one input
_LONGEST = 1000  # characters of a message


class TooSlowError(Exception):
    """An input kept the reader busy for longer than is allowed."""


@dataclass(frozen=True)
class Reader:
    """One reader of the project.

    Attributes:
        name: name of what it reads.
        form: format of the input, which is damaged in this form or as bytes.
        make: writes a sound input into an empty folder, and returns the file that is to be damaged.
        read: reads what is in the folder, with the damaged file; raises AssertionError if sound
            items do not come.
    """

    name: str
    form: Form
    make: Callable[[Path], Path]
    read: Callable[[Path], object]

    def hold(self, folder: Path, file: Path, content: bytes) -> bool:
        """Read a damaged input, and hold the reader to its word; return whether it was refused.

        Raises:
            Exception: whatever the reader raises but a proper error of the project.
        """
        file.write_bytes(content)
        try:
            with _at_most(_SECONDS):
                self.read(folder)
        except (InfthorError, SimulatorError) as error:
            message = str(error)
            assert message and len(message) < _LONGEST, (
                f"a message of {len(message)} characters: {message[:300]!r}"
            )
            assert not {"\n", "\r"} & set(message), f"no single line: {message!r}"
            assert message.count(str(file)) <= 1, f"names its place twice: {message!r}"
            return True
        return False


@contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Raise TooSlowError after some seconds of this process's processor time: a busy machine is no
    fault."""

    def stop(*_: Any) -> None:
        raise TooSlowError(f"takes more than {seconds} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
