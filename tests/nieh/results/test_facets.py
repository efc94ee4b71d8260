"""A facet of questions is one entry: tables, page, notebook, results and exports have it."""

import json

import pytest

from infthor_eval.nieh.results.facets import FACETS, N_WORDS

from ...helpers.nieh_runs import make_record
from ...helpers.processes import run_python

# Planted before anything else is imported, as an entry in the source would be.
_PLANTED = """
from pathlib import Path
from infthor_eval.nieh.results import facets
def room(record):
    return record.cluster.partition("-")[0]
facets.FACETS += (facets.QuestionFacet("room_kind", "kind of room", room),)
import infthor_eval
from infthor_eval.cli import main
def call(words):
    try:
        main(words.split())
    except SystemExit as end:
        assert not end.code
call("run --model oracle --tasks nieh_mini_gt --limit 30")
(folder,) = (path.parent for path in Path("results").rglob("results.json"))
call(f"show {folder} --full")
call(f"show {folder} --question {infthor_eval.load_run(folder)['id'][0]}")
call(f"report {folder} --out page.html")
call(f"export {folder} --format every-eval-ever --organization lab --out exported")
infthor_eval.load_run(folder).to_csv("frame.csv")
"""


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    done = run_python(_PLANTED, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


def test_a_planted_facet_is_in_results_and_tables(planted):
    folder, printed = planted
    (path,) = folder.rglob("results.json")
    cells = json.loads(path.read_text())["summary"]["tasks"]["nieh_mini_gt"]["by_room_kind"]
    assert sum(cell["n"] for cell in cells.values()) == 30
    assert len(cells) > 1
    assert "by kind of room (questions)" in printed
    assert "kind of room: " in printed  # of one question


def test_a_planted_facet_is_on_the_page_in_the_notebook_and_in_exports(planted):
    folder, _ = planted
    page = (folder / "page.html").read_text()
    assert "nieh_mini_gt: accuracy by kind of room" in page
    assert '"kind of room"' in page  # of each sample
    assert "room_kind" in (folder / "frame.csv").read_text().splitlines()[0]
    (samples,) = (folder / "exported").rglob("*_samples.jsonl")
    assert "kind of room" in json.loads(samples.read_text().splitlines()[0])["metadata"]


@pytest.mark.parametrize(
    ("n_words", "name"), [(1, "1-4"), (4, "1-4"), (5, "5-8"), (16, "13-16"), (17, ">16")]
)
def test_questions_are_apart_by_their_words(n_words, name):
    (facet,) = (facet for facet in FACETS if facet.name == "words")
    record = make_record(0, "mug", question=" ".join(["where"] * n_words))
    assert facet.class_of(record) == name
    assert name in N_WORDS
