"""The page of a suite that has no presenter: its tables, its primary metric, and its records as
samples."""

from pathlib import Path

import pytest

from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.run import Run
from infthor_eval.runs import RunConfig, RunHeader, RunSummary, UnitRecord

from ..helpers.toy_suite import Sum, ToySuite


def record(a, b, answer, **more):
    return UnitRecord(
        task="sums",
        id=f"{a}+{b}",
        cluster=f"from {a}",
        fingerprint="f",
        payload=Sum((a, b), answer),
        **more,
    )


def run(name, *records):
    header = RunHeader(
        suite="toy", name=name, config=RunConfig(model={"name": name}, tasks={"sums": {}})
    )
    suite = ToySuite()
    summary = RunSummary.of(suite, header, records)
    held = Run.held(Path(name), suite, summary, records, n_missing=0)
    held.presenter = PlainPresenter()
    return held


@pytest.fixture(scope="module")
def page():
    right = run("right", record(1, 3, 4), record(1, 4, 5))
    wrong = run("wrong", record(1, 3, 9), record(1, 4, None, failure="the abacus is broken"))
    return build_page([right, wrong], PageRequest())


def test_it_has_the_suites_tables_and_primary_metric(page):
    sections = {section.key: section for section in page.sections}
    assert sections["toy"].title == "Toy"
    assert [row.cells for row in sections["toy"].tables[0].rows] == [
        ("right", "2"),
        ("wrong (incomplete)", "1"),
    ]
    rows = [row.cells[:4] for row in sections["results"].tables[0].rows]
    assert rows == [
        ("right", "sums", "primary metric", "100.0"),
        ("wrong (incomplete)", "sums", "primary metric", "50.0"),
    ]
    (comparison,) = sections["comparison"].tables
    assert comparison.rows[0].cells[:6] == ("sums", "right", "%", "100.00", "0.00", "-100.00")


def test_its_samples_have_outcomes_scores_and_all_that_the_records_hold(page):
    first, second = page.samples
    assert (first.title, first.cluster) == ("1+3", "from 1")
    assert [result.outcome for result in first.results] == ["right", "wrong"]
    assert [result.scores for result in first.results] == [{"right": 1.0}, {"right": 0.0}]
    assert [result.details for result in first.results] == [
        {"numbers": "[1, 3]", "answer": "4"},
        {"numbers": "[1, 3]", "answer": "9"},
    ]
    assert [result.outcome for result in second.results] == ["right", "failed"]
    assert (second.results[1].reason, second.results[1].details) == (
        "the abacus is broken",
        {"numbers": "[1, 4]"},
    )


def test_a_long_field_is_cut(page):
    class Essay(Sum, frozen=True, tag_field="type", tag="essay"):
        text: str = ""

    long = record(1, 3, 4).__class__(
        task="t", id="i", cluster="c", fingerprint="f", payload=Essay((1, 3), 4, "x" * 5000)
    )
    assert len(PlainPresenter().details(long)["text"]) == 2001


@pytest.mark.parametrize(
    ("scores", "is_share"), [([0.0, 1.0], True), ([0.5, 1.5], False), ([-1.0, 0.0], False)]
)
def test_a_metric_beyond_a_share_is_shown_as_it_is(scores, is_share):
    assert PlainPresenter().is_share("reward", scores) == is_share


def test_the_browser_shows_the_fields(page, open_page):
    opened = open_page(page)
    details = opened.tab.locator("#sample .details").all_inner_texts()
    assert [text.split() for text in details] == [
        ["all", "runs", "numbers", "[1,", "3]"],
        ["right", "answer", "4"],
        ["wrong", "(incomplete)", "answer", "9"],
    ]
    opened.tab.fill("#search", "1, 4")
    assert opened.tab.locator("#count").inner_text() == "1 of 2"
    assert opened.errors == []
