"""Questions of a set that cannot be asked, on standard error."""

from collections.abc import Iterable
from pathlib import Path

from infthor_eval.cli.progress.notes import print_note
from infthor_eval.formats.question import SkippedQuestion
from infthor_eval.reasons import count_reasons

__all__ = ["print_left_out"]


def print_left_out(root: Path, skipped: Iterable[SkippedQuestion]) -> None:
    """Print how many questions of a set are left out, by reason; lines of a file are given as a
    range."""
    for _, reason, n in count_reasons(("", item.reason) for item in skipped):
        print_note(f"{root}: {n} question(s) left out: {reason}", "yellow")
