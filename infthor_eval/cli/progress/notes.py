"""Lines on standard error, beside the results."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from infthor_eval.reasons import count_reasons
from infthor_eval.terminal import error_console

if TYPE_CHECKING:
    from infthor_eval.formats.question import SkippedQuestion

NOTES = error_console()
_SHOWN = 3  # lines that are named


def print_note(text: str, style: str = "") -> None:
    """Print a line, unless notes are quiet."""
    NOTES.print(text, style=style)


def print_failure(text: str) -> None:
    """Print a line on what went wrong, even where notes are quiet."""
    error_console().print(text, style="red")


@contextlib.contextmanager
def quiet_notes(quiet: bool) -> Iterator[None]:
    """Print no notes within the context, where `quiet` is true."""
    NOTES.quiet = quiet
    try:
        yield
    finally:
        NOTES.quiet = False


def prints_as_notes() -> contextlib.AbstractContextManager[object]:
    """Send what code of others prints to standard error: other programs read our results."""
    return contextlib.redirect_stdout(sys.stderr)


def print_left_out(root: Path, skipped: Iterable[SkippedQuestion]) -> None:
    """Print how many questions of a set are left out, by reason; lines of a file as a range."""
    for _, reason, n in count_reasons(("", question.reason) for question in skipped):
        print_note(f"{root}: {n} question(s) left out: {reason}", "yellow")


def print_refused(name: str, what: str, lines: Sequence[tuple[Path, int, str]]) -> None:
    """Print how many lines of a run or log were left out, if any, and the first of them.

    Args:
        name: name of the run or log.
        what: what happened to the lines ("not imported").
        lines: log, number from 1 and reason of each line.
    """
    if lines:
        print_note(f"{name}: {len(lines)} row(s) {what}")
    for log, number, reason in lines[:_SHOWN]:
        print_note(f"  {log.name}, line {number}: {reason}")
    if len(lines) > _SHOWN:
        n_logs = len({log for log, _, _ in lines})
        print_note(f"  and {len(lines) - _SHOWN} more in {n_logs} log(s)")
