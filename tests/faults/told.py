"""What every fault is to end in: one line, with what is wrong, where, and the mend."""

from collections.abc import Callable
from pathlib import Path

import pytest

from infthor_eval.errors import InfthorError

__all__ = ["Fault", "refused", "said_in_one_line"]

Fault = Callable[[Path], object]


def refused(do: Callable[[], object], said: str) -> None:
    """Hold that something is refused in one line that says so."""
    with pytest.raises(InfthorError) as caught:
        do()
    message = str(caught.value)
    assert said in message
    assert "\n" not in message
    assert len(message) < 700


def said_in_one_line(ended: tuple[int, str, str], said: str, code: int = 2) -> None:
    """Hold that a command ended with an exit code, without output, and with one line that says
    why."""
    found, out, err = ended
    assert "Traceback" not in err
    (line,) = [line for line in err.splitlines() if line.startswith("infthor-eval: ")]
    assert said in line
    assert (found, out) == (code, "")
