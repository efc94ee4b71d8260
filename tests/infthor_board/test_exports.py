"""Scores and means that exports tell, whatever else is in their rows."""

import json

import pytest

from infthor_board.exports import read_exported_means, read_exported_scores
from infthor_eval.runs import UnitKey


def row(task, metric, score, question="home/1", **more):
    return {
        "evaluation_id": "x",
        "model_id": "lab/model",
        "sample_id": question,
        "evaluation_result_id": f"{task}/{metric}",
        "evaluation": {"score": score},
        "metadata": {"task": task, "question_id": question},
    } | more


def write(path, *rows):
    path.write_text("".join(f"{json.dumps(one)}\n" for one in rows))
    return path


def test_one_question_of_two_tasks_has_two_scores(tmp_path):
    rows = [row("nieh_gt", "strict", 1.0), row("nieh_full", "strict", 0.0)]
    scores = read_exported_scores(write(tmp_path / "a_samples.jsonl", *rows))
    assert scores.tasks == {"nieh_gt", "nieh_full"}
    for task, score in (("nieh_gt", 1.0), ("nieh_full", 0.0)):
        assert scores.of(task, UnitKey(task, "home/1")) == {"strict": score}
    assert scores.models == {"lab/model"}


@pytest.mark.parametrize(
    "strange",
    [
        {"metadata": [1]},
        {"metadata": {"frames": "0-999999999"}},
        {"evaluation": "good"},
        {"evaluation": {"score": "1"}},
        {"sample_id": None, "metadata": None},
    ],
)
def test_a_strange_row_tells_nothing(tmp_path, strange):
    rows = [row("nieh_gt", "strict", 1.0, "home/2", **strange), row("nieh_gt", "strict", 0.5)]
    scores = read_exported_scores(write(tmp_path / "a.jsonl", *rows))
    assert scores.of("nieh_gt", UnitKey("nieh_gt", "home/1")) == {"strict": 0.5}


def test_lm_evals_files_tell_task_scores_and_means(tmp_path):
    doc = {"doc": {"question_id": "home/1"}, "resps": [["yes"]], "strict": 1.0, "reference": 1.0}
    path = write(tmp_path / "samples_nieh_mini_gt_2026-11-26T14-12-22.223585.jsonl", doc)
    results = {"results": {"nieh_mini_gt": {"strict,none": 0.25, "alias": "x"}}}
    (tmp_path / "results_2026-11-26T14-12-22.223585.json").write_text(json.dumps(results))
    scores = read_exported_scores(path)
    assert scores.tasks == {"nieh_mini_gt"}
    assert scores.of("", UnitKey("nieh_mini_gt", "home/1")) == {"strict": 1.0, "reference": 1.0}
    assert read_exported_means(path) == {("nieh_mini_gt", "strict"): 0.25}


@pytest.mark.parametrize("document", ["[]", "{}", '{"evaluation_results": [1, {"a": 2}]}'])
def test_a_strange_summary_tells_nothing(tmp_path, document):
    (tmp_path / "a.json").write_text(document)
    assert read_exported_means(write(tmp_path / "a_samples.jsonl")) == {}
