"""The pages about the code name what is there, and all of it."""

import re
import tomllib
from pathlib import Path

import pytest

from .blocks import ROOT

PAGES = (
    "docs/architecture.md",
    "docs/where-things-go.md",
    "CONTRIBUTING.md",
    "infthor_board/README.md",
    "infthor_sim/README.md",
)
PACKAGES = ("infthor_eval", "infthor_board", "infthor_sim", "model_adapters", "recipes")
PLACE = re.compile(r"`([\w./-]+?(?:/|\.(?:py|yaml|md|js|html|css|txt|gz)))(?:: ?(\w+))?`")
# Files of runs and of recorded data, which are not in the tree.
WRITTEN = {
    "results.json",
    "usage.json",
    "run.yaml",
    "submission.yaml",
    "alfred/layouts/",
    "thor_scenes/objects.jsonl.gz",
    "DIR/procthor/asset-database.json.gz",
}
SOURCES = [
    path
    for top in (*PACKAGES, "tasks", "tests", "docs", "benchmarks", "examples", "results", ".ci")
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
    rows = [f"`{name}/`" for name in PACKAGES if name != "infthor_eval"]
    rows += [f"`infthor_eval/{name}/`" for name in rooms("infthor_eval")]
    modules = {path.name for path in (ROOT / "infthor_eval").glob("*.py")}
    rows += [f"`{name}`" for name in modules - {"__init__.py", "__main__.py"}]
    assert [row for row in rows if row not in page] == []


def test_the_row_of_a_package_names_its_rooms() -> None:
    lines = (ROOT / "docs/architecture.md").read_text().splitlines()
    folders = [*PACKAGES[1:]]
    folders += [f"infthor_eval/{name}" for name in rooms("infthor_eval")]
    for folder in folders:
        (row,) = (line for line in lines if line.startswith(f"| `{folder}/` |"))
        assert [name for name in rooms(folder) if f"`{name}/`" not in row] == [], folder


def rooms(folder: str) -> list[str]:
    """Names of the packages directly in one."""
    return sorted(path.parent.name for path in (ROOT / folder).glob("*/__init__.py"))


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
    packages = {f"infthor_eval.{name}" for name in rooms("infthor_eval")} | set(PACKAGES[1:])
    free = {"infthor_eval.cli"}  # which may import anything but the simulator
    assert packages - held - free == set()
