"""What a run leaves beside its journal: what it found, equal for equal runs, and what it took."""

import json
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.runs import NOTHING, RunConfig, RunHeader, RunSummary, Usage, execute, prepare
from infthor_eval.runs.results import results_document, write_usage
from tests.helpers.toy_suite import ToySuite
from tests.runs.toy_command import request

COUNTS = st.integers(0, 10**9)


@given(st.lists(st.tuples(COUNTS, COUNTS), max_size=5))
def test_the_hit_rate_is_a_share_of_what_was_read(counts: list[tuple[int, int]]) -> None:
    usage = Usage.total(Usage(1, max(pair), min(pair)) for pair in counts)
    if usage.context == 0:
        assert usage.hit_rate is None
        return
    assert usage.hit_rate == usage.cached / usage.context
    assert 0 <= usage.hit_rate <= 1


@pytest.mark.parametrize(
    ("usage", "description"),
    [
        (
            Usage(2, 1000, 250, 10),
            "2 requests, 1,000 tokens read (250 of them cached, 25.0 %), 10 written",
        ),
        (Usage(2), "2 requests, their tokens not counted"),
        (
            Usage(2, 1000, 0, 10, 0.5),
            "2 requests, 1,000 tokens read (0 of them cached, 0.0 %), 10 written, 0.5000 US "
            "dollars",
        ),
    ],
)
def test_usage_in_words(usage: Usage, description: str) -> None:
    assert usage.description == description


class _Timed(msgspec.Struct):
    right: int
    took: float


class _Worded(_Timed):
    def document(self) -> dict[str, Any]:
        return {"of 2": self.right, "took": self.took}


@pytest.mark.parametrize(
    ("summary", "document"), [(_Timed(1, 0.5), {"right": 1}), (_Worded(1, 0.5), {"of 2": 1})]
)
def test_results_leave_out_what_a_summary_took(summary: Any, document: dict[str, Any]) -> None:
    header = RunHeader(suite="toy", name="a", config=RunConfig(tasks={"sums": {}}))
    suite: Any = SimpleNamespace(primary_metrics=lambda _: {})
    run = RunSummary(header, summary)
    assert results_document(run, suite, 0, NOTHING)["summary"] == document


def test_what_was_taken_is_written_as_it_is(tmp_path: Any) -> None:
    records: Any = [SimpleNamespace(seconds=seconds) for seconds in (0.25, 1.5)]
    write_usage(tmp_path, records, Usage(3, 300, 100, 7, 0.125))
    assert json.loads((tmp_path / "usage.json").read_text()) == {
        "requests": 3,
        "read": 300,
        "cached": 100,
        "hit_rate": 0.333333,
        "written": 7,
        "seconds": 1.75,
        "cost": 0.125,
    }


def test_the_scores_of_every_unit_stand_in_a_file(tmp_path: Any) -> None:
    folder = execute(prepare(request(tmp_path), ToySuite())).folder
    rows = [json.loads(line) for line in (folder / "scores.jsonl").read_text().splitlines()]
    assert [row["id"] for row in rows] == ["1+3", "1+4", "2+3", "2+4"]
    assert rows[0] == {
        **{"task": "sums", "id": "1+3", "variant": "", "cluster": "from 1"},
        **{"state": "answered", "scores": {"right": 1.0}, "failure": None, "excluded": None},
    }
    assert (rows[2]["state"], rows[2]["failure"]) == ("failed", "the abacus is broken")


def test_what_a_task_is_known_by_stands_in_the_results(tmp_path: Any) -> None:
    folder = execute(prepare(request(tmp_path), ToySuite())).folder
    assert json.loads((folder / "results.json").read_text())["primary_metrics"] == {
        "sums": {"mean": 0.5, "low": None, "high": None, "n": 4}
    }


def test_a_run_writes_both_and_results_have_nothing_that_differs(tmp_path: Any) -> None:
    suite = ToySuite()
    outcome = execute(prepare(request(tmp_path), suite))
    results, took = (
        (outcome.folder / name).read_bytes() for name in ("results.json", "usage.json")
    )
    again = execute(prepare(request(tmp_path), suite))
    assert (again.folder / "results.json").read_bytes() == results
    assert json.loads(took)["requests"] == json.loads(results)["usage"]["requests"]
    assert not {"seconds", "cached", "hit_rate"} & json.loads(results)["usage"].keys()
