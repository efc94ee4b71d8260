"""The commands in the documentation: those of README and tutorials run, the others are parsed."""

import functools
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from infthor_eval.cli.main import _infthor_eval
from infthor_eval.runs import Catalog
from infthor_eval.suites import baseline_suites
from model_adapters import has_option, is_known, name_on_engine, names

from .blocks import ROOT, written_files
from .commands import CANNOT_RUN, FLOOR_PLANS, Command, command_blocks

RUN_PAGES = (
    "README.md",
    "docs/tutorial.md",
    "docs/own-models.md",
    "docs/own-tasks.md",
    "docs/training.md",
)
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/**/*.md"))
)
COMMANDS = [
    (page, command) for page in PAGES for block in command_blocks(page) for command in block
]
BLOCKS = [
    pytest.param(page, block, id=f"{page}-{number}")
    for page in RUN_PAGES
    for number, block in enumerate(command_blocks(page))
    if any(command.reason is None for command in block)
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
        return folder

    return folder_of


@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("page", "block"), BLOCKS)
def test_the_commands_of_a_page_run_one_after_the_other(
    page, block, folder_of, run_cli, monkeypatch
):
    monkeypatch.chdir(folder_of(page))
    for command in block:
        if command.reason == FLOOR_PLANS:
            break  # what follows asks about what it makes
        if command.reason is None:
            code, _, err = (_apart if "lm-eval" in command.words else run_cli)(
                *_with_globs(command.words[1:])
            )
            assert code == 0, f"{page}: {command.text}\n{err}"


def _apart(*words):
    """In a process of its own: lm-eval remembers which model it has loaded."""
    code = "import sys; from infthor_eval.cli import main; main(sys.argv[1:])"
    done = subprocess.run(
        [sys.executable, "-c", code, *words], check=False, capture_output=True, text=True
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
        pytest.param(command, id=f"{page}: {command.text}"[:110])
        for page, command in COMMANDS
        if command.is_ours
    ],
)
def test_the_options_of_every_command_are_known(command, monkeypatch):
    monkeypatch.setattr(click.Path, "convert", lambda self, value, parameter, context: Path(value))
    context = _infthor_eval.make_context("infthor-eval", list(command.words[1:]))
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
    ours = [command.text for _, command in COMMANDS if command.is_ours]
    for pattern in CANNOT_RUN:
        assert any(re.search(pattern, text) for text in ours), pattern


def test_a_renamed_option_would_be_found(monkeypatch):
    words = ("infthor-eval", "--model", "oracle", "--tasks", "nieh_mini", "--limits", "3")
    with pytest.raises(click.ClickException, match="No such option"):
        test_the_options_of_every_command_are_known(Command(" ".join(words), words), monkeypatch)
