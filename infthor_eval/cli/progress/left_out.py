"""Questions of a set and lines of a log that are left out, on standard error."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from infthor_eval.cli.progress.notes import print_note
from infthor_eval.formats.question import SkippedQuestion
from infthor_eval.reasons import count_reasons

__all__ = ["print_left_out", "print_refused"]

_SHOWN = 3  # lines that are named


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
