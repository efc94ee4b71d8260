"""`show --per-sample` and `show --format parquet`: samples for other programs."""

import csv
import io
import subprocess
import sys

import pandas
import pytest

import infthor_eval
from tests.helpers.command_line import assert_refused
from tests.helpers.processes import cli_words


@pytest.fixture
def folders(make_nieh_set, evaluate):
    """The folders of runs of the oracle and of the blind on five questions."""
    data = make_nieh_set(size=56)
    return [evaluate(model, data=data) for model in ("oracle", "blind")]


def test_csv_has_a_row_per_sample_of_every_run(folders, run_cli):
    code, out, err = run_cli("show", *folders, "--per-sample", "--format", "csv")
    assert (code, err) == (0, "")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [row["run"] for row in rows] == ["oracle"] * 5 + ["blind"] * 5
    assert {row["score_strict"] for row in rows[:5]} == {"1"}
    assert {row["n_clues"] for row in rows} == {"1", "2", "3"}


@pytest.mark.parametrize(
    "options", [("--format", "parquet"), ("--per-sample", "--format", "parquet")]
)
def test_parquet_is_the_frame(folders, options):
    words = cli_words("show", *folders[:1], *options)
    done = subprocess.run(words, capture_output=True, check=True, timeout=600)
    pandas.testing.assert_frame_equal(
        pandas.read_parquet(io.BytesIO(done.stdout)),
        infthor_eval.load_run(folders[0]),
        check_dtype=True,
    )


@pytest.mark.parametrize(
    "options",
    [
        ("--per-sample",),
        ("--per-sample", "--format", "latex"),
        ("--per-sample", "--json"),
        ("--format", "parquet", "--full"),
    ],
)
def test_what_has_no_row_per_sample_is_refused(folders, run_cli, options):
    assert_refused(
        run_cli("show", *folders, *options),
        "--per-sample: is for --format csv and --format parquet",
    )


def test_parquet_is_not_written_on_a_terminal(folders, run_cli, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert_refused(
        run_cli("show", *folders, "--format", "parquet"),
        "write it into a file, `> samples.parquet`",
    )
