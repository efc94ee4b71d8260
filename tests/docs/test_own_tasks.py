"""docs/own-tasks.md agrees with the code, and its tasks run."""

import json
import re

from PIL import Image

from infthor_eval.nieh.contexts import CONTEXTS

from .blocks import ROOT, written_files
from .settings_tables import PAGE, with_tables


def test_the_tables_of_settings_are_those_of_the_code():
    page = PAGE.read_text()
    assert page.count("| setting |") == page.count("<!-- end -->") == 3
    assert with_tables(page) == page, "run: python -m tests.docs.settings_tables"


def test_all_contexts_are_named():
    said = (
        (ROOT / "docs/own-tasks.md")
        .read_text()
        .partition("`dataset_kwargs`: `context` (")[2]
        .partition(";")[0]
    )
    assert re.findall(r"`(\w+)`", said) == list(CONTEXTS)


def test_the_suite_of_the_page_is_the_example(tmp_path):
    written_files("docs/own-tasks.md", tmp_path)
    suite = "infthor_sums/__init__.py"
    assert (tmp_path / suite).read_text() == (ROOT / "examples/sums" / suite).read_text()
    lines = sum(
        len(path.read_text().splitlines()) for path in (ROOT / "examples/sums").rglob("*.py")
    )
    assert lines <= 60


def test_own_tasks_run_with_the_shared_files_of_this_package(tmp_path, run_cli, monkeypatch):
    written_files("docs/own-tasks.md", tmp_path)
    monkeypatch.chdir(tmp_path)
    options = ("--include-path", "my_tasks", "--limit", 3)
    code, _, err = run_cli("--model", "oracle", "--tasks", "nieh_mini_words,nieh_mini_gt", *options)
    assert code == 0, err
    (results,) = tmp_path.rglob("results.json")
    tasks = json.loads(results.read_text())["summary"]["tasks"]
    assert {name: task["metrics"] for name, task in tasks.items()} == {
        "nieh_mini_words": ["one_word"],
        "nieh_mini_gt": ["reference", "strict"],
    }


def test_a_folder_of_frames_and_a_csv_runs_with_no_other_file(tmp_path, run_cli, monkeypatch):
    written_files("docs/own-tasks.md", tmp_path)
    monkeypatch.chdir(tmp_path)
    for number in range(1, 12):
        Image.new("RGB", (28, 28), (number, 0, 0)).save(tmp_path / f"my_folder/{number}.png")
    code, _, err = run_cli("--model", "oracle", "--tasks", "nieh_gt", "--data", "my_folder")
    assert code == 0, err
    (results,) = tmp_path.rglob("results.json")
    document = json.loads(results.read_text())
    assert document["primary_metrics"]["nieh_gt"]["n"] == 2
    assert document["primary_metrics"]["nieh_gt"]["mean"] == 1.0
    code, _, err = run_cli("--model", "blind", "--tasks", "nieh_gt", "--data", "my_folder")
    assert code == 0, err
    code, _, err = run_cli("--model", "blind", "--tasks", "nieh_text_state", "--data", "my_folder")
    assert (code, len(err.splitlines())) == (2, 1), "no trajectory file, no states"
    code, _, err = run_cli("validate", "my_folder", "--model", "a,b,c,d", "--out", "out")
    assert (code, len(err.splitlines())) == (2, 1)


def test_own_tasks_are_refused_in_one_line(tmp_path, run_cli, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "task.yaml").write_text("include: _nieh.yaml\ntask: nieh_gt\n")
    typed = ("--model", "oracle", "--tasks", "nieh_gt")
    code, _, err = run_cli(*typed, "--include-path", "a")
    assert (code, len(err.splitlines())) == (2, 1)
    assert "'nieh_gt' is the name of another task file too" in err
    (tmp_path / "a" / "task.yaml").write_text("include: _none.yaml\ntask: own\n")
    assert "_none.yaml: cannot be read" in run_cli(*typed, "--include-path", "a")[2]
    assert "Directory 'b' does not exist" in run_cli(*typed, "--include-path", "b")[2]
