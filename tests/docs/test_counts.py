"""What pages say of the size of the bundled sets is what is in the sets."""

import csv
import gzip
import json
import re
from collections.abc import Iterator

import pytest

from infthor_eval.storage.folders import packaged_folder

from ..helpers.bundled import BUNDLED
from .blocks import ROOT

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md"))
)
SETS = re.compile(r"(nieh|plans|final|manipulathor)_mini|bundled (sets?|ones|trajector)")
PARTS = re.compile(r"\n\n|\n(?=- |\d+\. |\|)")  # paragraphs, items of a list, rows of a table
WORDS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
NUMBER = rf"(\d[\d,]*|{'|'.join(WORDS)})"
COUNT = re.compile(rf"\b{NUMBER} (questions|question types|trajectories|plans)\b")


def counts() -> dict[str, set[int]]:
    """The numbers that may be said of a bundled set, by what is counted."""
    rows = list(csv.DictReader((BUNDLED / "qa_set_nieh_mini.csv").read_text().splitlines()))
    with gzip.open(packaged_folder("sets/plans_mini") / "trajectories.jsonl.gz") as lines:
        trajectories = [json.loads(line) for line in lines]
    tasks = [[task["high_pddl_idx"] for task in one["sub_trajs"]] for one in trajectories]
    asked_for = sum(end - first for ranges in tasks for first, end in ranges)
    final = sum(end - first for *_, (first, end) in tasks)
    return {
        "questions": {len(rows), 2 * len(rows)},  # on one task, and on both
        "question types": {len({row["question_type"] for row in rows})},
        "trajectories": {len({row["traj_id"] for row in rows}), len(trajectories)},
        "plans": {asked_for, final},
    }


def said(page: str) -> Iterator[tuple[str, str, int]]:
    """Counts on a page where it speaks of a bundled set: the part of the page, what is counted, how
    many."""
    for part in PARTS.split((ROOT / page).read_text()):
        if SETS.search(part):
            for number, what in COUNT.findall(part):
                value = WORDS.index(number) + 1 if number in WORDS else int(number.replace(",", ""))
                yield part, what, value


@pytest.mark.parametrize("page", PAGES)
def test_no_page_says_another_count(page):
    allowed = counts()
    wrong = [(part, what, value) for part, what, value in said(page) if value not in allowed[what]]
    assert wrong == []


def test_the_counts_are_said_where_a_reader_looks_for_them():
    allowed = counts()
    assert ("questions", min(allowed["questions"])) in {found[1:] for found in said("docs/nieh.md")}
    on_plans = {found[1:] for found in said("docs/plans.md")}
    wanted = {(what, value) for what in ("plans", "trajectories") for value in allowed[what]}
    assert on_plans == wanted


def test_the_table_of_the_readme_has_all_questions():
    shown = re.findall(r"nieh_mini_gt .* (\d+)$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert [*map(int, shown)] == 3 * [min(counts()["questions"])]
