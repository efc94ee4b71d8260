"""The pages about the code name what is there, and all of it."""

import re
import tomllib
from pathlib import Path

import pytest

from .blocks import ROOT

PAGES = ("docs/architecture.md", "docs/where-things-go.md", "CONTRIBUTING.md")
PLACE = re.compile(r"`([\w./-]+?(?:/|\.(?:py|yaml|md|js|html|css|txt|gz)))(?:: ?(\w+))?`")
WRITTEN = {"results.json", "usage.json", "run.yaml"}  # files of runs, which are not in the tree
SOURCES = [
    path
    for top in (
        "infthor_eval",
        "model_adapters",
        "tasks",
        "tests",
        "docs",
        "benchmarks",
        "examples",
        "results",
        ".ci",
    )
    for path in (ROOT / top).rglob("*")
    if "__pycache__" not in path.parts
]


def named(page: str) -> list[tuple[str, str]]:
    """Places that a page names, each with the function behind its colon."""
    return PLACE.findall((ROOT / page).read_text())


@pytest.mark.parametrize("page", PAGES)
def test_every_place_that_is_named_is_there(page: str) -> None:
    missing = []
    for place, function in named(page):
        ends = tuple(Path(place).parts)
        matches = [
            path
            for path in (*SOURCES, ROOT / place)
            if path.parts[-len(ends) :] == ends and path.exists()
        ]
        if not matches and place not in WRITTEN:
            missing.append(place)
        elif function and not any(
            f"{function}" in path.read_text() for path in matches if path.is_file()
        ):
            missing.append(f"{place}: {function}")
    assert missing == []


def test_every_package_and_module_has_its_row() -> None:
    page = (ROOT / "docs/architecture.md").read_text()
    packages = {path.parent.name for path in (ROOT / "infthor_eval").glob("*/__init__.py")}
    modules = {path.name for path in (ROOT / "infthor_eval").glob("*.py")} - {
        "__init__.py",
        "__main__.py",
    }
    engines = {path.parent.name for path in (ROOT / "model_adapters").glob("*/__init__.py")}
    assert [name for name in sorted(packages) if f"`infthor_eval/{name}/`" not in page] == []
    assert [name for name in sorted(modules) if f"`{name}`" not in page] == []
    assert [name for name in sorted(engines) if f"`{name}/`" not in page] == []


def test_every_package_has_its_import_contract() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
        "contracts"
    ]
    held = {
        name
        for one in contracts
        for key in ("source_modules", "protected_modules")
        for name in one.get(key, ())
    }
    packages = {
        f"infthor_eval.{path.parent.name}" for path in (ROOT / "infthor_eval").glob("*/__init__.py")
    }
    free = {"infthor_eval.cli"}  # which may import anything but the simulator
    assert packages - held - free == set()
