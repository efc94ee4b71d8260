"""Names of suites are known to the suites, their presenters and `infthor_eval.suites` alone."""

import ast
from pathlib import Path

import pytest

from infthor_eval.suites import suite_names

ROOT = Path(__file__).parents[1] / "infthor_eval"
ROOMS = ("report", "cli")
PRESENTERS = ROOT / "report" / "suites"
FILES = [
    path
    for room in ROOMS
    for path in sorted((ROOT / room).rglob("*.py"))
    if PRESENTERS not in path.parents
]


def decisions(tree):
    """Strings that decide something: compared, looked up, keys of a dictionary, cases of a
    match."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            yield from sides
            yield from (
                item
                for side in sides
                if isinstance(side, ast.Tuple | ast.List | ast.Set)
                for item in side.elts
            )
        elif isinstance(node, ast.Dict):
            yield from filter(None, node.keys)
        elif isinstance(node, ast.Subscript):
            yield node.slice
        elif isinstance(node, ast.MatchValue):
            yield node.value
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "get"
        ):
            yield from node.args[:1]


def names_decided_on(source):
    strings = (
        node.value for node in decisions(ast.parse(source)) if isinstance(node, ast.Constant)
    )
    return sorted({text for text in strings if text in suite_names()})


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_name_of_a_suite_decides_anything_outside_of_its_presenter(path):
    assert names_decided_on(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "source",
    [
        "if suite == 'nieh': pass",
        "{'plans': 1}",
        "found['plans']",
        "names.get('nieh')",
        "x in ('nieh', 'a')",
    ],
)
def test_a_name_that_decides_would_be_found(source):
    assert names_decided_on(source)


def test_the_page_names_no_suite():
    scripts = [
        path
        for path in (ROOT / "report" / "web").iterdir()
        if path.suffix in (".js", ".html", ".css")
    ]
    assert scripts
    for path in scripts:
        text = path.read_text(encoding="utf-8")
        assert not [name for name in suite_names() if f'"{name}"' in text or f"'{name}'" in text]
