"""What `--help` says: an example first, commands in groups."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from infthor_board.cli import _infthor_board
from infthor_eval.cli.help import ExampleCommand, ExampleGroup
from infthor_eval.cli.main import _infthor_eval

from ..helpers.command_line import read_success

GROUPS = ("Evaluate", "Look at results", "Make data", "Own models", "Tools")


def _commands(parent: click.Context) -> Iterator[click.Context]:
    assert isinstance(parent.command, click.Group)
    for name in parent.command.list_commands(parent):
        command = parent.command.get_command(parent, name)
        assert command is not None
        context = click.Context(command, info_name=name, parent=parent)
        yield context
        if isinstance(command, click.Group):
            yield from _commands(context)


COMMANDS = [
    context
    for program in (_infthor_eval, _infthor_board)
    for context in _commands(click.Context(program, info_name=program.name))
    if context.info_name != "lm-eval"  # whose help is lm-eval's own
]


@pytest.mark.parametrize("context", COMMANDS, ids=[context.command_path for context in COMMANDS])
def test_help_begins_with_an_example_that_the_command_takes(context, monkeypatch):
    command = context.command
    assert isinstance(command, ExampleCommand | ExampleGroup)
    lines = command.get_help(context).splitlines()
    assert lines[:2] == ["Example:", f"  {command.example}"]
    assert lines[3].startswith("Usage: ")
    assert len(command.example) <= 100
    words = shlex.split(command.example)
    typed = context.command_path.split()
    assert words[: len(typed)] == typed or isinstance(command, click.Group)
    monkeypatch.setattr(click.Path, "convert", lambda self, value, parameter, context: Path(value))
    if not isinstance(command, click.Group):
        command.make_context(str(context.info_name), words[len(typed) :])


def test_the_overview_has_commands_in_groups(run_cli):
    out, _ = read_success(run_cli("--help"))
    assert out.startswith("Example:\n  infthor-eval --model ")
    headings = re.findall(r"^(\w[^:\n]*):$", out, re.MULTILINE)
    assert headings[:-1] == ["Example", *GROUPS, "Options"]
    assert headings[-1] == "Options of a run (`infthor-eval run --help` has all)"
    assert "  --model MODEL,... " in out
    assert "--check-equality" not in out
    parts = ("Evaluate:", "  plan ", "Look at results:", "compare")
    assert sorted(parts, key=out.index) == list(parts)
    assert run_cli("--version")[1].startswith("infthor-eval, version ")


def test_the_options_of_a_run_are_by_suite(run_cli):
    out, _ = read_success(run_cli("run", "--help"))
    headings = re.findall(r"^(Options.*):$", out, re.MULTILINE)
    assert headings[0] == "Options"
    assert {"Options of nieh", "Options of plans", "Options of manipulation"} <= set(headings)
    assert out.index("--limit") < out.index("Options of nieh:") < out.index("--k-tokens")
