"""A cell of a table is read at a glance; what needs more words is a list or a sentence beside
it."""

import re

import pytest

from .blocks import ROOT

# A list of what there is, a row for each thing with all that is to be said of it.
LONGER = {"docs/architecture.md"}
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md"))
)
CODE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
BETWEEN = re.compile(r"(?<!\\)\|")


@pytest.mark.parametrize("page", sorted(set(PAGES) - LONGER))
def test_no_cell_has_more_than_thirty_words(page):
    rows = re.findall(r"^\|(.*)\|$", CODE.sub("", (ROOT / page).read_text()), re.MULTILINE)
    cells = [cell.strip() for row in rows for cell in BETWEEN.split(row)]
    assert [cell for cell in cells if len(cell.split()) > 30] == []
