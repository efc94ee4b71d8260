"""Answered, failed and not asked are told apart in every table, chart and export."""

import csv
import io
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from infthor_eval.exports.lm_eval import convert_run
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.report.live.state import LiveRun
from infthor_eval.report.svg import draw
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.report.web.page import write_page
from infthor_eval.run import open_runs
from infthor_eval.runs import RunSummary, TaskFile, UnitDoc

from ..helpers.journals import write_journal
from ..helpers.nieh_runs import make_config, make_header, make_record

N_UNITS = 8  # of which 4 are answered, 1 failed, 1 is beyond a cap, and 2 are not come to
LOST = [
    make_record(4, None, failure="the server is down"),
    make_record(5, None, failure="not asked: a cap is reached", asked=False),
]
PLANTED = [make_record(0, "cup"), *(make_record(number, "mug") for number in (1, 2, 3)), *LOST]
NOTHING = [make_record(number, None, failure="the server is down") for number in range(N_UNITS)]
WHOLE = [make_record(number, "mug") for number in range(N_UNITS)]
UNITS = {"answered": 4, "failed": 1, "not_asked": 3, "excluded": 0}


def header_of(name: str) -> Any:
    config = make_config(model=name, checkpoint=None, n_parameters=None)
    config["tasks"]["nieh_gt"]["n_samples"] = N_UNITS
    header = make_header(config, name)
    return msgspec.structs.replace(header, n_units=N_UNITS, units_by_task={"nieh_gt": N_UNITS})


def write(folder: Path, name: str, records: list[Any]) -> Path:
    return write_journal(folder / name / "nieh-1", header_of(name), records, RECORDS)


@pytest.fixture
def planted(tmp_path: Path) -> Path:
    return write(tmp_path, "m", PLANTED)


@pytest.fixture
def nothing(tmp_path: Path) -> Path:
    return write(tmp_path, "dead", NOTHING)


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    return write(tmp_path, "w", WHOLE)


def test_the_tables_of_show(planted: Path, whole: Path, run_cli) -> None:
    _, out, _ = run_cli("show", planted, whole)
    (row,) = [line for line in out.splitlines() if "75.00 of 4 answered" in line]
    assert "m (incomplete)" in row
    assert row.split()[-3:] == ["8", "1", "3"]  # all, failed, not asked
    assert "w (incomplete)" not in out
    _, out, _ = run_cli("show", planted, whole, "--full")
    (row,) = [line for line in out.splitlines() if "m (incomplete)" in line and "strict" in line]
    assert row.count("75.00 of 4") == 3  # in words that go on in the next line
    assert row.split()[-4:] == ["8", "0", "1", "3"]


def test_the_list_of_runs(planted: Path, nothing: Path, run_cli, tmp_path: Path) -> None:
    _, out, _ = run_cli("ls", "runs", tmp_path, "--format", "csv")
    rows = {row["run"]: row for row in csv.DictReader(io.StringIO(out))}
    states = ("answered", "failed", "not asked")
    assert [rows["m (incomplete)"][state] for state in states] == ["4", "1", "3"]
    assert [rows["dead (incomplete)"][state] for state in states] == ["0", "8", "0"]


def test_the_same_as_csv_and_json(planted: Path, run_cli) -> None:
    _, out, _ = run_cli("show", planted, "--format", "csv")
    (row,) = csv.DictReader(line for line in io.StringIO(out) if not line.startswith("#"))
    assert (row["model"], row["total"], row["total answered"]) == ("m (incomplete)", "75.00", "4")
    assert (row["n"], row["failed"], row["not asked"]) == ("8", "1", "3")
    _, out, _ = run_cli("show", planted, "--json")
    (document,) = json.loads(out)
    assert document["units"] == {"nieh_gt": UNITS}
    assert document["n_missing"] == 2
    rate = document["primary_metrics"]["nieh_gt"]
    assert (rate["mean"], rate["n"], rate["n_all"]) == (0.75, 4, 8)


def test_the_rows_of_samples(planted: Path, run_cli) -> None:
    _, out, _ = run_cli("show", planted, "--per-sample", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(out)))
    states = [(row["state"], row["score_strict"]) for row in rows]
    assert states[:4] == [("answered", "0"), *[("answered", "1")] * 3]
    assert states[4:] == [("failed", ""), ("not asked", "")]
    assert {row["run"] for row in rows} == {"m (incomplete)"}


def test_a_comparison_is_over_what_both_answered(planted: Path, whole: Path, run_cli) -> None:
    for options in ([], ["--same-questions"]):
        code, out, _ = run_cli("compare", planted, whole, *options)
        (row,) = [line for line in out.splitlines() if " strict " in line]
        assert (code, row.split()[-2:]) == (0, ["4", "4"])
        assert "m (incomplete)" in out


def test_the_page_with_its_tables_charts_and_samples(planted: Path, whole: Path, tmp_path) -> None:
    runs = open_runs([planted, whole])
    page = build_page(runs, PageRequest())
    charts = [chart for section in page.sections for chart in section.charts]
    assert charts
    assert all("m (incomplete)" in draw(chart) for chart in charts)
    (results,) = [section for section in page.sections if section.key == "results"]
    row, _ = results.tables[0].rows
    assert row.cells[0] == "m (incomplete)"
    assert (row.cells[3], row.cells[6]) == ("75.0 of 4 answered", "8")
    assert "m (incomplete)" in results.lead and "(4 of 8 answered)" in results.lead
    left_out = next(section for section in page.sections if section.key == "left-out").tables[0]
    assert [row.cells[2] for row in left_out.rows] == ["failed", "not asked", "not asked"]
    assert left_out.rows[0].cells[3:] == ("1", "the server is down")
    first_run = [sample.results[0] for sample in page.samples]
    outcomes = [None if result is None else result.outcome for result in first_run]
    assert outcomes == ["wrong", *["right"] * 3, "failed", "not asked", None, None]
    assert dict(page.runs[0].facts)["state"] == "4 answered, 1 failed, 3 not asked"
    write_page(page, tmp_path / "page.html")
    assert "75.0 of 4 answered" in (tmp_path / "page.html").read_text()


def test_the_live_page(planted: Path) -> None:
    state = LiveRun(planted).state()
    totals = state.totals
    assert (totals.n_done, totals.n_failed, totals.n_not_asked, state.n_units) == (6, 1, 1, 8)
    (rate,) = state.metrics.values()
    assert (rate.mean, rate.n, rate.n_all) == (0.75, 4, 8)
    assert [sample.outcome for sample in state.failures] == ["not asked", "failed"]


def exported(records: list[Any], folder: Path) -> Any:
    """A run in lm-eval's form, of which only what the conversion reads is there."""
    task = TaskFile("nieh_gt", "nieh", Path("nieh_gt.yaml"), {})
    tasks = SimpleNamespace(tasks=[task], limit=None, seed=0)
    request = SimpleNamespace(tasks=tasks, model="m", model_options={})
    docs = [
        UnitDoc(number, {"id": record.id}, "mug", "?", {}, record.payload.reply or "")
        for number, record in enumerate(records)
    ]
    run = SimpleNamespace(request=request, suite=NiehSuite())
    summary = RunSummary.of(NiehSuite(), header_of("m"), records)
    outcome = {"run": run, "records": records, "docs": docs, "summary": summary}
    return convert_run(SimpleNamespace(**outcome, n_missing=2, folder=folder))  # type: ignore[arg-type]


def test_the_folder_for_lm_eval(planted: Path) -> None:
    run = exported(PLANTED, planted)
    assert run.results["n-samples"] == {"nieh_gt": {"original": 8, "effective": 4}}
    assert run.results["infthor_eval"]["units"] == {"nieh_gt": UNITS}
    means = run.results["results"]["nieh_gt"]
    assert (means["strict,none"], means["sample_len"]) == (0.75, 4)
    rows = run.samples["nieh_gt"]
    assert [row["strict"] for row in rows] == [0.0, 1.0, 1.0, 1.0, None, None]
    assert [row["infthor_eval"]["state"] for row in rows[4:]] == ["failed", "not asked"]


def test_a_run_that_failed_on_everything_has_no_score(
    nothing: Path, whole: Path, run_cli, tmp_path
) -> None:
    for options in ([], ["--full"]):
        _, out, _ = run_cli("show", nothing, *options)
        assert "none answered" in out
        assert "0.00" not in out
    _, out, _ = run_cli("show", nothing, "--json")
    (document,) = json.loads(out)
    assert document["primary_metrics"] == {}
    page = build_page(open_runs([nothing, whole]), PageRequest())
    cells = [row.cells for row in page.sections[0].tables[0].rows]
    assert ("dead (incomplete)", "none answered") in [(row[0], row[3]) for row in cells]
    assert LiveRun(nothing).state().metrics == {}
    results = exported(NOTHING, nothing).results
    assert "strict,none" not in results["results"]["nieh_gt"]
    assert results["n-samples"] == {"nieh_gt": {"original": 8, "effective": 0}}
    code, _, err = run_cli("compare", nothing, whole)
    assert (code, "with a result in both" in err) == (2, True)
