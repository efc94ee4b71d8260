"""The one place where text meets the terminal.

Names, questions and replies come from data and models. Whatever is in them is shown as text: no markup of rich's, no
emoji, and no control character, which could move the cursor, colour what follows or rename the window.
"""

import unicodedata
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

__all__ = ["PlainConsole", "console", "error_console", "print_error", "print_line", "printable", "progress_bar"]

_KEPT = "\n\t"
_HIDDEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}  # controls, what reorders or hides text, halves of pairs, line separators


def printable(text: str) -> str:
    r"""A text with what is no text in it written out (`\x1b`), but for line ends and tabs."""
    if text.isprintable():
        return text
    return "".join(
        letter
        if letter in _KEPT or unicodedata.category(letter) not in _HIDDEN
        else letter.encode("unicode_escape").decode("ascii")
        for letter in text
    )


class PlainConsole(Console):
    """A console that takes no string for anything but text, whether it is printed or stands in a table."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, markup=False, emoji=False, highlight=False, soft_wrap=True)

    def render_str(self, text: str, **settings: Any) -> Text:
        """See `rich.console.Console.render_str`; every string that is shown comes by here."""
        settings |= {"markup": False, "emoji": False, "highlight": False}
        return super().render_str(printable(text), **settings)


def console(**settings: Any) -> PlainConsole:
    """Standard output."""
    return PlainConsole(**settings)


def error_console() -> PlainConsole:
    """Standard error, for what is said beside the results."""
    return PlainConsole(stderr=True)


class _Description(TextColumn):
    """What a bar is about, as text."""

    def __init__(self) -> None:
        super().__init__("", markup=False)

    def render(self, task: Any) -> Text:
        """See `rich.progress.TextColumn.render`."""
        return Text(printable(task.description))


def progress_bar(on: Console) -> Progress:
    """A bar that goes away when the work is done; nothing where there is no terminal to draw it on."""
    columns = (_Description(), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    return Progress(*columns, console=on, transient=True, disable=not on.is_terminal)


def print_line(text: str) -> None:
    """A line on standard output."""
    click.echo(printable(text))


def print_error(text: str) -> None:
    """An error of the whole command, one line on standard error."""
    click.echo(f"infthor-eval: {printable(' '.join(text.split()))}", err=True)
