"""The code in the documentation: commands and Python run, page by page and in order, but for those
that cannot; their options are known all the same."""

import functools
import os
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from PIL import Image

from infthor_board.cli import _infthor_board
from infthor_eval.cli.main import _infthor_eval
from infthor_eval.runs import Catalog
from infthor_eval.suites import baseline_suites
from model_adapters import has_option, is_known, name_on_engine, names

from .blocks import ROOT, written_files
from .commands import (
    CANNOT_RUN,
    PARSED_PAGES,
    Command,
    all_pages,
    code_of,
    count_commands,
)

COMMANDS = [command for page in all_pages() for code in code_of(page) for command in code.commands]
_PICTURES = 12
BLOCKS = [
    pytest.param(page, code, id=f"{page}-{number}")
    for page in all_pages()
    for number, code in enumerate(code_of(page))
    if code.runs
]


@pytest.fixture(scope="module")
def folder_of(tmp_path_factory):
    """Gives the folder in which a page's reader is: each block finds what those before it have
    left."""

    @functools.cache
    def folder_of(page):
        folder = tmp_path_factory.mktemp("reader")
        written_files(page, folder)
        (folder / "tasks").symlink_to(ROOT / "tasks")
        for table in folder.glob("*/questions.csv"):  # beside a reader's own pictures
            for number in range(_PICTURES):
                Image.new("RGB", (28, 28)).save(table.parent / f"{number}.png")
        return folder

    return folder_of


@pytest.fixture(scope="module")
def names_of():
    """Gives the names that a page's Python has made so far."""
    return functools.cache(lambda page: {})


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("page", "code"), BLOCKS)
def test_the_commands_of_a_page_run_one_after_the_other(
    page, code, folder_of, names_of, run_cli, monkeypatch
):
    monkeypatch.chdir(folder_of(page))
    if code.python:
        exec(compile(code.python, page, "exec"), names_of(page))
    for command in code.commands:
        if command.reason is None:
            apart = command.needs_shell or "lm-eval" in command.words
            ended, _, err = (
                _in_shell(command) if apart else run_cli(*_with_globs(command.words[1:]))
            )
            assert ended == command.exit_code, f"{page}: {command.text}\n{err}"


def _in_shell(command):
    """In a process of its own, as typed. (lm-eval remembers which model it has loaded.)"""
    environment = {
        **os.environ,
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"])),
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        ["bash", "-c", command.text], check=False, capture_output=True, text=True, env=environment
    )
    return done.returncode, done.stdout, done.stderr


def _with_globs(words):
    return [
        path
        for word in words
        for path in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
    ]


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(command, id=f"{command.page}: {command.text}"[:110])
        for command in COMMANDS
        if command.is_ours
    ],
)
def test_the_options_of_every_command_are_known(command, monkeypatch):
    monkeypatch.setattr(click.Path, "convert", lambda self, value, parameter, context: Path(value))
    words = list(command.words[1:])
    if ">" in words:  # the shell's
        words = words[: words.index(">")]
    program = {it.name: it for it in (_infthor_eval, _infthor_board)}[command.words[0]]
    context = program.make_context(program.name, words)
    while isinstance(context.command, click.Group):
        name, inner, rest = context.command.resolve_command(
            context, [*context._protected_args, *context.args]
        )
        assert inner is not None
        context = inner.make_context(name, rest, parent=context)
    if context.info_name in ("run", "plan"):
        _check_names(context.params)


def _check_names(given):
    """Models, their options and tasks are known, but for those of the example packages and of files
    beside a page."""
    engine = given["engine"]
    for model, own in given["models"]:
        if model in ("thumbnails", "calculator") or model in baseline_suites():
            continue
        assert is_known(model), f"{model}: there are {names()}"
        if model in names():
            name = name_on_engine(model, engine) if engine else model
            assert all(has_option(name, option) for option in {**given["model_args"], **own}), name
    own = {"nieh_mini_last", "nieh_mini_start", "nieh_mini_words", "my_task", "sums_small"}
    catalog = Catalog.find_packaged()
    for task in set(given["tasks"].split(",")) - own:
        assert task in catalog.tasks or task in catalog.groups


def test_every_exception_is_still_needed():
    texts = [command.text for command in COMMANDS if command.page not in PARSED_PAGES]
    for pattern in CANNOT_RUN:
        assert any(re.search(pattern, text) for text in texts), pattern
    assert set(PARSED_PAGES) <= {command.page for command in COMMANDS}


def test_what_does_not_run_has_a_reason_and_is_counted():
    counts = count_commands()
    n_python = sum(bool(code.python) for page in all_pages() for code in code_of(page))
    assert sum(counts.values()) == len(COMMANDS) + n_python
    assert counts["run"] >= 50
    assert all(counts.values())


def test_a_renamed_option_would_be_found(monkeypatch):
    words = ("infthor-eval", "--model", "oracle", "--tasks", "nieh_mini", "--limits", "3")
    with pytest.raises(click.ClickException, match="No such option"):
        test_the_options_of_every_command_are_known(
            Command("README.md", " ".join(words), words), monkeypatch
        )
