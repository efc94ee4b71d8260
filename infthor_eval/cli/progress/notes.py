"""Lines on standard error, beside the results."""

import contextlib
from collections.abc import Iterator

from infthor_eval.terminal import error_console

__all__ = ["NOTES", "print_failure", "print_note", "quiet_notes"]

NOTES = error_console()


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
