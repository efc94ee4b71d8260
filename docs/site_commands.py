"""The page of all commands, generated from their help (a hook of mkdocs)."""

import inspect
from collections.abc import Iterator
from typing import Any

import click

from infthor_board.cli import _infthor_board
from infthor_eval.cli.help import ExampleCommand, ExampleGroup
from infthor_eval.cli.main import _infthor_eval

__all__ = ["commands", "on_page_markdown"]

_PLACE = "<!-- commands -->"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Insert the commands into a page that has the place for them."""
    return markdown.replace(_PLACE, commands()) if _PLACE in markdown else markdown


def commands() -> str:
    """Return a section for each command: example, usage, help, options."""
    tops = [click.Context(it, info_name=it.name) for it in (_infthor_eval, _infthor_board)]
    return "\n\n".join(_section(context) for top in tops for context in _all(top))


def _all(parent: click.Context) -> Iterator[click.Context]:
    """Yield the commands of a group, and those of the groups among them."""
    assert isinstance(parent.command, click.Group)
    for name in parent.command.list_commands(parent):
        command = parent.command.get_command(parent, name)
        assert command is not None
        context = click.Context(command, info_name=name, parent=parent)
        yield context
        if isinstance(command, click.Group):
            yield from _all(context)


def _section(context: click.Context) -> str:
    command = context.command
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    rows = [
        record
        for option in command.get_params(context)
        if (record := option.get_help_record(context))
    ]
    table = [f"| `{names}` | {_cell(help_text)} |" for names, help_text in rows]
    text = inspect.cleandoc(command.help or "")
    example = (
        ["```", command.example, "```", ""]
        if isinstance(command, ExampleCommand | ExampleGroup)
        else []
    )
    head = [f"## {context.command_path}", *example, f"`{usage}`", "", text, ""]
    return "\n".join([*head, "| option | |", "|---|---|", *table])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")
