"""Runs as data frames: a row per sample, numbers as numbers, for every suite."""

import io
import shutil
import subprocess
import sys
from pathlib import Path

import msgspec
import pandas
import pytest
from pandas.api.types import is_bool_dtype, is_numeric_dtype

import infthor_eval
from infthor_eval.cli import main
from infthor_eval.errors import DataError, UsageError
from infthor_eval.nieh.records import RECORDS
from infthor_eval.report.sample_columns import ENVELOPE
from infthor_eval.report.sample_table import encode_samples, sample_table
from infthor_eval.report.suites.episodes import ARM_COLUMNS, PLAN_COLUMNS
from infthor_eval.report.suites.nieh_columns import NIEH_COLUMNS
from infthor_eval.run import open_runs
from infthor_eval.runs import UnitRecord
from infthor_eval.runs.stored.search import read_results
from tests.helpers.command_line import option_words
from tests.helpers.journals import write_journal
from tests.helpers.nieh_runs import make_config, make_header, make_record

ROOT = Path(__file__).parents[1]
TASKS = {
    "nieh": ("blind", "nieh_mini_gt", "20"),
    "plans": ("scripted", "infthor_plans_mini", "1"),
    "manipulation": ("still", "manipulathor_mini", "2"),
}
COLUMNS = {"nieh": NIEH_COLUMNS, "plans": PLAN_COLUMNS, "manipulation": ARM_COLUMNS}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The folder of a run of each suite."""
    output = tmp_path_factory.mktemp("runs")
    folders = {}
    for suite, (model, task, limit) in TASKS.items():
        with pytest.raises(SystemExit) as ended:
            main(option_words(model=model, tasks=task, limit=limit, out=str(output / suite)))
        assert ended.value.code == 0
        (folders[suite],) = (output / suite / model).iterdir()
    return folders


@pytest.mark.parametrize("suite", TASKS)
def test_the_means_of_a_frame_are_those_of_the_run(suite: str, runs: dict[str, Path]) -> None:
    frame = infthor_eval.load_run(runs[suite])
    results = read_results(runs[suite])
    assert results is not None
    score = "score_strict" if suite == "nieh" else "score_success"
    for task, metric in results.primary_metrics.items():
        scores = frame.loc[frame["task"] == task, score]
        assert len(scores) == metric.n
        assert scores.mean() == pytest.approx(metric.mean)
    assert set(frame["task"]) == set(results.primary_metrics)


@pytest.mark.parametrize("suite", TASKS)
def test_numbers_are_numbers_and_texts_are_texts(suite: str, runs: dict[str, Path]) -> None:
    frame = infthor_eval.load_run(str(runs[suite]))
    for name, form, _ in (*ENVELOPE, *COLUMNS[suite]):
        is_right = {str: pandas.api.types.is_string_dtype, bool: is_bool_dtype}.get(
            form, is_numeric_dtype
        )
        assert is_right(frame[name]), name
    assert all(is_numeric_dtype(frame[name]) for name in frame if name.startswith("score_"))
    assert (frame["seconds"] > 0).any()


def test_every_column_is_documented() -> None:
    page = (ROOT / "docs/formats.md").read_text()
    documented = page[page.index("## Samples as a table") :]
    names = {column.name for columns in (ENVELOPE, *COLUMNS.values()) for column in columns}
    # One for each scorer.
    guesses = {name for name in names if name.startswith(("blind_", "above_blind_"))}
    wanted = {
        "run",
        "suite",
        "score_METRIC",
        "blind_SCORER",
        "above_blind_SCORER",
        *(names - guesses),
    }
    assert sorted(name for name in wanted if f"`{name}`" not in documented) == []


@pytest.fixture
def make_run(tmp_path: Path):
    """Writes the journal of a run of NIEH."""

    def make_run(*records: UnitRecord) -> Path:
        config = make_config(model="m", checkpoint=None, n_parameters=None)
        return write_journal(tmp_path / "run", make_header(config, "m"), records, RECORDS)

    return make_run


def test_a_failed_sample_and_an_excluded_one_have_no_scores(make_run) -> None:
    excluded = msgspec.structs.replace(
        make_record(2, None, ("Bed",), failure="x"), failure=None, excluded="no frame"
    )
    frame = infthor_eval.load_run(
        make_run(
            make_record(0, "Bed", ("Bed",)),
            make_record(1, None, ("Bed",), failure="it fails"),
            excluded,
        )
    )
    frame = frame.set_index("id").sort_index()
    assert frame["score_strict"].fillna(-1).tolist() == [1.0, -1.0, -1.0]
    assert frame["state"].tolist() == ["answered", "failed", "excluded"]
    assert frame["failure"].fillna("").tolist() == ["", "it fails", ""]
    assert frame["excluded"].fillna("").tolist() == ["", "", "no frame"]


def test_a_run_that_has_no_sample_yet_is_an_empty_frame(make_run) -> None:
    frame = infthor_eval.load_run(make_run())
    assert len(frame) == 0
    assert "n_clues" in frame


def test_csv_is_safe_to_open_and_parquet_is_exact(make_run) -> None:
    replies = [
        '=HYPERLINK("http://x")',
        "\x1b[31mred\x07",
        'two\nlines, "quoted"',
        "-1",
        "'",
        "naïve ∞",
    ]
    folder = make_run(*(make_record(place, reply, ("Bed",)) for place, reply in enumerate(replies)))
    table = sample_table(open_runs([folder]))
    exact = pandas.read_parquet(io.BytesIO(encode_samples(table, "parquet")))
    assert sorted(exact["reply"]) == sorted(replies)
    text = encode_samples(table, "csv")
    safe = pandas.read_csv(io.BytesIO(text))
    safe_replies = [
        '\'=HYPERLINK("http://x")',
        "\\x1b[31mred\\x07",
        replies[2],
        "-1",
        "''",
        "naïve ∞",
    ]
    assert sorted(safe["reply"]) == sorted(safe_replies)
    assert b"\x1b" not in text
    assert safe["score_strict"].tolist() == exact["score_strict"].tolist()


def test_a_folder_without_a_run_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no journal in it; give the folder of a run"):
        infthor_eval.load_run(tmp_path)


def test_the_package_is_imported_without_pandas() -> None:
    code = (
        "import infthor_eval, sys; print(*{'pandas', 'pyarrow', 'numpy', "
        "'click'}.intersection(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=600
    )
    assert done.stdout.split() == []


def test_a_call_runs_what_the_command_runs(tmp_path: Path) -> None:
    given = {"limit": 4, "out": tmp_path / "called", "frames": None, "quiet": True}
    frame = infthor_eval.evaluate(model="oracle,blind", tasks=["nieh_mini_gt"], **given)
    assert list(frame["run"]) == ["oracle", "blind"]
    assert list(frame["state"]) == ["whole", "whole"]
    assert frame["score"].iloc[0] == 1.0
    assert (frame["n"] == 4).all()
    assert (frame["low"] <= frame["score"]).all()
    typed = option_words(model="oracle,blind", tasks="nieh_mini_gt", limit=4, out=tmp_path / "o")
    with pytest.raises(SystemExit):
        main(typed)
    there = infthor_eval.load_runs(tmp_path / "o").set_index("run")
    numbers = ["suite", "task", "score", "low", "high", "answered", "failed", "not_asked"]
    assert there.loc[frame["run"], numbers].equals(frame.set_index("run")[numbers])


def test_a_call_with_what_the_command_refuses_raises(tmp_path: Path) -> None:
    for options in ({"limit": "many"}, {"no_such": 1}, {"model_args": {"nothing": 1}}):
        with pytest.raises(UsageError):
            infthor_eval.evaluate(model="oracle", tasks="nieh_mini_gt", out=tmp_path, **options)
    with pytest.raises(UsageError, match="unknown model"):
        infthor_eval.evaluate(model="orakle", tasks="nieh_mini_gt", out=tmp_path)


def test_a_run_that_cannot_be_read_is_left_out_with_a_warning(
    runs: dict[str, Path], tmp_path: Path
) -> None:
    shutil.copytree(runs["nieh"], tmp_path / "good")
    (tmp_path / "bad" / "journal").mkdir(parents=True)
    with pytest.warns(UserWarning, match="bad: cannot be read"):
        frame = infthor_eval.load_runs(tmp_path)
    assert list(frame["folder"]) == [str(tmp_path / "good")]


_TELL_STATE = """
import gc, json, logging, os, resource, signal, sys, warnings

def state():
    return {
        "frozen": gc.get_freeze_count(),
        "collection": gc.get_threshold(),
        "signals": [str(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)],
        "handlers": [str(handler) for handler in logging.getLogger().handlers],
        "level": logging.getLogger().level,
        "warnings": [str(one) for one in warnings.filters],
        "streams": [sys.stdout.errors, sys.stderr.errors],
        "memory": resource.getrlimit(resource.RLIMIT_AS),
        "environment": dict(os.environ),
    }
"""


def test_importing_the_package_changes_nothing_of_the_process(tmp_path: Path) -> None:
    """What the command does to its own process is not done to that of a notebook."""
    code = (
        _TELL_STATE
        + f"""
# Of other packages, whose imports add filters of warnings.
import matplotlib.figure, numpy, pandas, pyarrow, rich, torch, transformers
before = state()
import infthor_eval
infthor_eval.load_run, infthor_eval.load_runs, infthor_eval.load_sample, infthor_eval.load_figure
import infthor_eval.cli.evaluation, infthor_eval.report.sample, infthor_eval.report.named_figures
assert state() == before, (before, state())
infthor_eval.evaluate(model="blind", tasks="nieh_mini_gt", limit=2, out={str(tmp_path)!r})
after = state()
for changed in ("warnings", "environment"):  # by lm-eval and others that it needs
    before.pop(changed), after.pop(changed)
assert after == before, (before, after)
"""
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr


def test_a_bar_is_shown_in_a_notebook_and_lines_elsewhere(monkeypatch) -> None:
    from infthor_eval.terminal import PlainConsole, progress_bar

    assert progress_bar(PlainConsole(file=io.StringIO())).disable
    assert not progress_bar(PlainConsole(file=io.StringIO(), force_jupyter=True)).disable
    assert not progress_bar(PlainConsole(file=io.StringIO(), force_terminal=True)).disable
