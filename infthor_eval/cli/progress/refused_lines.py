"""Lines of a log that were left out, on standard error: their number, and the first of them."""

from collections.abc import Sequence
from pathlib import Path

from infthor_eval.cli.progress.notes import print_note

__all__ = ["print_refused"]

_SHOWN = 3  # lines that are named


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
        print_note(
            f"  and {len(lines) - _SHOWN} more in {len({log for log, _, _ in lines})} log(s)"
        )
