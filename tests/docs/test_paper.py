"""The part of docs/paper.md on claims: every file, option and test that it names is there."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import click
import pytest

from infthor_eval.cli.main import _infthor_eval
from infthor_eval.runs import Catalog
from infthor_eval.training.recipe import recipe_names

from .blocks import ROOT

PAGE = (ROOT / "docs/paper.md").read_text().partition("## The appendices, claim by claim")[2]
TABLE_ROW = re.compile(r"^\| (?!---|claim)(.+?) \|$", re.MULTILINE)
TEST = re.compile(r"`(tests/[\w/]+\.py)(?:::(\w+))?`")
FILE = re.compile(
    r"`((?:infthor_eval|infthor_sim|model_adapters|tasks|results|benchmarks|docs)/[\w./-]+)`"
)
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
SECTIONS = ("A.1.1", "A.1.2", "A.1.3", "A.2", "B.1", "C.1", "C.2", "D")


def rows() -> list[list[str]]:
    return [[cell.strip() for cell in line.split(" | ")] for line in TABLE_ROW.findall(PAGE)]


@cache
def options() -> frozenset[str]:
    """All options of all commands."""
    context = click.Context(_infthor_eval)
    commands = [
        _infthor_eval.get_command(context, name) for name in _infthor_eval.list_commands(context)
    ]
    return frozenset(option for command in commands for option in _options(command))


def _options(command: click.Command | None) -> Iterator[str]:
    for parameter in () if command is None else command.params:
        yield from parameter.opts + parameter.secondary_opts


@cache
def functions_of(path: Path) -> frozenset[str]:
    tree = ast.parse(path.read_text())
    return frozenset(node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def test_every_section_of_the_appendices_has_its_claims():
    for section in SECTIONS:
        assert re.search(rf"^### {re.escape(section)}[ ,]", PAGE, re.MULTILINE), section
    assert len(rows()) >= 40


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0][:50])
def test_a_row_says_what_is_claimed_where_it_is_done_and_what_holds_it(row):
    assert len(row) == 4
    claim, place, _, held = row
    assert claim
    assert FILE.search(place) or "not " in place, (
        "a claim has a place, or it is said that it has none"
    )
    assert TEST.search(held) or FILE.search(held) or held.startswith("nothing"), (
        "a claim is held by something"
    )


def test_every_file_is_there():
    assert [name for name in FILE.findall(PAGE) if not (ROOT / name).exists()] == []


def test_every_test_is_there():
    missing = []
    for file, name in TEST.findall(PAGE):
        if not (ROOT / file).is_file() or (name and name not in functions_of(ROOT / file)):
            missing.append(f"{file}::{name}")
    assert missing == []


def test_every_option_task_and_recipe_is_there():
    assert sorted(set(OPTION.findall(PAGE)) - options()) == []
    catalog = Catalog.find_packaged()
    named = {name for names in re.findall(r"--tasks ([\w,]+)", PAGE) for name in names.split(",")}
    assert sorted(named - {*catalog.tasks, *catalog.groups}) == []
    assert sorted(set(re.findall(r"--recipe (\w+)", PAGE)) - {*recipe_names()}) == []
