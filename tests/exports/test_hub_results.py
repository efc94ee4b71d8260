"""The hub's files, read by its own library."""

import json

import pytest
import yaml
from huggingface_hub import parse_eval_result_entries

from .conftest import primary_metrics


def entries_of(out):
    (path,) = out.rglob(".eval_results/*.yaml")
    return path.relative_to(out), parse_eval_result_entries(yaml.safe_load(path.read_text()))


@pytest.mark.parametrize("suite", ["nieh", "plans"])
def test_a_result_for_each_task_in_percent(runs, export, suite):
    out = export(runs[suite], "hf-eval-results", "--dataset", "me/infthor")
    path, entries = entries_of(out)
    assert path.parts[:2] == ("infthor-eval", runs[suite].parent.name)
    expected = primary_metrics(runs[suite])
    assert {entry.task_id: entry.value for entry in entries} == {
        task: round(100 * rate["mean"], 4) for task, rate in expected.items()
    }
    assert {entry.dataset_id for entry in entries} == {"me/infthor"}
    document = yaml.safe_load((out / "me" / "infthor" / "eval.yaml").read_text())
    assert document["evaluation_framework"] == "infthor-eval"
    assert [task["id"] for task in document["tasks"]] == list(expected)


def test_notes_say_the_interval_and_how_it_was_run(questions_run, export):
    words = ("--dataset", "me/infthor", "--source-url", "https://example.org/runs")
    _, (entry,) = entries_of(export(questions_run, "hf-eval-results", *words))
    rate = primary_metrics(questions_run)["nieh_gt"]
    version = json.loads((questions_run / "results.json").read_text())["config"]["infthor_eval"]
    assert f"95 % interval {100 * rate['low']:.1f} to {100 * rate['high']:.1f}" in entry.notes
    assert f"infthor-eval {version}, config {questions_run.name[-16:]}" in entry.notes
    assert "not whole" not in entry.notes
    assert entry.source_url == "https://example.org/runs"


def test_notes_say_what_is_not_whole(arm_run, export):
    _, entries = entries_of(export(arm_run, "hf-eval-results", "--dataset", "me/infthor"))
    notes = {entry.task_id: entry.notes for entry in entries}
    assert "1 of 2 failed, in no score; 1 excluded" in notes["arm_pickup"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((), "--format hf-eval-results: results name their data set; give --dataset"),
        (("--frames",), "--frames: has no place in hf-eval-results; leave it out"),
        (("--dataset", "mine"), "--dataset 'mine': is not OWNER/NAME"),
        (("--dataset", "a/b", "--model-id", "/c"), "--model-id '/c': is not OWNER/NAME"),
    ],
)
def test_without_names_it_is_refused(questions_run, run_cli, tmp_path, words, reason):
    out = tmp_path / "out"
    ended = run_cli("export", questions_run, "--format", "hf-eval-results", "--out", out, *words)
    assert (ended[0], ended[1], ended[2].count("\n")) == (2, "", 1)
    assert reason in ended[2]
