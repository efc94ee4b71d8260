"""The tables of docs/where-things-go.md, from the ends of module docstrings.

    python docs/where_things_go.py

writes them. A module that is the main place of an everyday change says so in the last paragraphs of
its docstring, one for each change:

    To add or change WHAT: HOW.
    To add WHAT: HOW.

HOW is short enough for a cell of a table. "Here" is the module or package. Places are in backticks,
as paths from the module's folder or from the repository's.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "where-things-go.md"
ROOMS = ("infthor_board", "infthor_eval", "infthor_sim", "model_adapters", "recipes", "tests")
WORDS = 30  # of a cell, as tests/docs/test_tables.py has it

# Headings in the order of the page; a module belongs to the longest path that it begins with.
_SECTIONS = {
    "Questions, models, policies": (
        "infthor_eval/generation/",
        "infthor_eval/memory/",
        "infthor_eval/nieh/",
        "model_adapters/",
        "tests/model_adapters/",
    ),
    "A suite": (
        "infthor_eval/episodes/",
        "infthor_eval/runs/",
        "infthor_eval/suites.py",
        "infthor_eval/settings.py",
    ),
    "Plans and manipulation": (
        "infthor_eval/household/",
        "infthor_eval/manipulation/",
        "infthor_eval/plans/",
    ),
    "Simulator and workers": (
        "infthor_eval/runs/work/",
        "infthor_eval/thor/",
        "infthor_eval/workers/",
        "infthor_sim/",
    ),
    "Command line, report, data": (
        "infthor_board/",
        "infthor_eval/cli/",
        "infthor_eval/errors.py",
        "infthor_eval/exports/",
        "infthor_eval/formats/",
        "infthor_eval/harness/",
        "infthor_eval/pages/",
        "infthor_eval/report/",
        "infthor_eval/statistics.py",
        "infthor_eval/storage/",
    ),
    "Training": ("infthor_eval/training/", "recipes/"),
}
_BEGINNING = "To add "
_PARAGRAPH = re.compile(r"To add (?:or change )?([^:|]+): ([^|]+)\.")
_ARTICLE = re.compile(r"^(?:an?|the) ")
_GENERATED = re.compile(r"(<!-- from docstrings -->\n).*?(<!-- end -->)", re.DOTALL)


class ChangeError(Exception):
    """A paragraph on a change that the page cannot take; its message names module and reason."""


@dataclass(frozen=True)
class Change:
    """An everyday change.

    Attributes:
        what: what is added or changed.
        place: path of its main place below the repository, with a slash at the end of a package's.
        how: what is edited there and elsewhere.
    """

    what: str
    place: str
    how: str


def find_changes(root: Path = ROOT) -> list[Change]:
    """Find the changes that the modules of a repository name.

    Raises:
        ChangeError: a paragraph is malformed, or two modules name the same change.
    """
    changes: dict[str, Change] = {}
    for room in ROOMS:
        for path in sorted((root / room).rglob("*.py")):
            docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
            for change in changes_of(docstring, path.relative_to(root).as_posix()):
                other = changes.setdefault(change.what, change)
                if other is not change:
                    raise ChangeError(f"{change.place}: {other.place} has '{change.what}' too")
    return list(changes.values())


def changes_of(docstring: str, module: str) -> Iterator[Change]:
    """Yield the changes in the docstring of a module, which is named by its path.

    Raises:
        ChangeError: a paragraph is malformed, or another one follows it.
    """
    place = module.removesuffix("__init__.py")
    begun = False
    for paragraph in docstring.split("\n\n"):
        text = " ".join(paragraph.split())
        if text.startswith(_BEGINNING):
            begun = True
            yield _parse(text, place)
        elif begun:
            raise ChangeError(f"{module}: '{_BEGINNING}...' is not at the docstring's end")


def _parse(text: str, place: str) -> Change:
    match = _PARAGRAPH.fullmatch(text)
    if match is None:
        raise ChangeError(
            f"{place}: '{text}' is not of the form 'To add WHAT: HOW.' or 'To add or change WHAT: "
            "HOW.', without | in either"
        )
    what, how = match.groups()
    n_words = len(how.split())
    if n_words > WORDS:
        raise ChangeError(f"{place}: how to add {what} has {n_words} words; at most {WORDS}")
    return Change(what, place, how)


def with_tables(page: str, changes: Iterable[Change]) -> str:
    """Return the page with its tables, between the markers, made anew.

    Raises:
        ChangeError: a change belongs to no section, or the page has no markers.
    """
    sections: dict[str, list[Change]] = defaultdict(list)
    for change in changes:
        sections[_section_of(change.place)].append(change)
    tables = "\n".join(
        f"## {heading}\n{_table(sections[heading])}" for heading in _SECTIONS if heading in sections
    )
    made, n_places = _GENERATED.subn(lambda match: f"{match[1]}{tables}{match[2]}", page)
    if n_places != 1:
        raise ChangeError(f"{PAGE.name}: its tables stand between two markers, {n_places} times")
    return made


def _section_of(place: str) -> str:
    beginnings = {
        beginning: heading
        for heading, places in _SECTIONS.items()
        for beginning in places
        if place.startswith(beginning)
    }
    if not beginnings:
        raise ChangeError(f"{place}: no section of {PAGE.name} has it")
    return beginnings[max(beginnings, key=len)]


def _table(changes: Sequence[Change]) -> str:
    ordered = sorted(changes, key=lambda change: _ARTICLE.sub("", change.what).lower())
    rows = [f"| {change.what} | `{change.place}` | {change.how} |" for change in ordered]
    return "\n".join(["| to add or change | in | how |", "|---|---|---|", *rows]) + "\n"


def main() -> int:
    """Write the page; exit with 1 and one line if a paragraph is malformed."""
    try:
        page = with_tables(PAGE.read_text(encoding="utf-8"), find_changes())
    except ChangeError as error:
        print(error, file=sys.stderr)
        return 1
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
