"""The one place where text is written to the terminal.

Names, questions and replies come from data and models. They are shown as plain text: no rich
markup, no emoji codes, and no control characters, which could move the cursor, colour what follows
or rename the window.
"""

import unicodedata
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.text import Text

from infthor_eval.errors import OutputClosed

_KEPT = "\n\t"
# Control, reordering or hiding, lone surrogates, line separators.
_HIDDEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def printable(text: str) -> str:
    r"""Return the text with control characters escaped (`\x1b`), except line ends and tabs."""
    if text.isprintable():
        return text
    return "".join(
        letter
        if letter in _KEPT or unicodedata.category(letter) not in _HIDDEN
        else letter.encode("unicode_escape").decode("ascii")
        for letter in text
    )


class PlainConsole(Console):
    """A console that shows every string as plain text, whether it is printed or in a table."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings, markup=False, emoji=False, highlight=False, soft_wrap=True)

    def render_str(self, text: str, **settings: Any) -> Text:
        """See `rich.console.Console.render_str`, through which every string goes that is shown."""
        settings |= {"markup": False, "emoji": False, "highlight": False}
        return super().render_str(printable(text), **settings)

    def on_broken_pipe(self) -> None:
        """See `rich.console.Console.on_broken_pipe`, which ends the program as well."""
        try:
            super().on_broken_pipe()
        except SystemExit as error:
            raise OutputClosed(error.code) from error


def console(**settings: Any) -> PlainConsole:
    """Return a console on standard output."""
    return PlainConsole(**settings)


def error_console() -> PlainConsole:
    """Return a console on standard error, for messages beside the results."""
    return PlainConsole(stderr=True)


class _Description(TextColumn):
    """The description of a progress bar, as plain text."""

    def __init__(self) -> None:
        super().__init__("", markup=False)

    def render(self, task: Any) -> Text:
        """See `rich.progress.TextColumn.render`."""
        return Text(printable(task.description))


def progress_bar(on: Console) -> Progress:
    """Return a bar that disappears when done; it is disabled but on a terminal or in a notebook."""
    columns = (_Description(), BarColumn(), MofNCompleteColumn())
    is_shown = on.is_terminal or on.is_jupyter
    return Progress(*columns, console=on, transient=True, disable=not is_shown)


def print_line(text: str) -> None:
    """Print a line on standard output."""
    try:
        click.echo(printable(text))
    except BrokenPipeError as error:
        raise OutputClosed(1) from error


def print_error(text: str, program: str = "infthor-eval") -> None:
    """Print the error that ends a program, as one line on standard error."""
    click.echo(f"{program}: {printable(' '.join(text.split()))}", err=True)
