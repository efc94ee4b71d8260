"""Numbers that a task file makes of replies itself, under our own runs."""

import json

import pytest

from infthor_eval.errors import DataError
from infthor_eval.nieh.metrics import PUBLISHED, metrics_of
from infthor_eval.runs import Catalog, execute

OWN = """
include: _nieh.yaml
task: nieh_own
dataset_kwargs: {context: clues}
process_results: !function own.measure
metric_list:
  - {metric: letters, aggregation: mean, higher_is_better: true}
  - {metric: plain, higher_is_better: true}
"""
MEASURE = """
def measure(doc, results):
    said, = results
    return {"letters": len(said) / 20, "plain": doc["question"].startswith("Is"), "unlisted": 1.0}
"""


@pytest.fixture
def own(task_files):
    """Writes the task `nieh_own` with its function beside it."""

    def write(function=MEASURE, task=OWN):
        (task_files / "nieh" / "nieh_own.yaml").write_text(task)
        (task_files / "nieh" / "own.py").write_text(function)

    return write


def task():
    return Catalog.find_packaged().tasks["nieh_own"]


def test_the_files_function_makes_the_scores_and_the_published_scorers_stay_out(prepare_run, own):
    own()
    outcome = execute(prepare_run(tasks=("nieh_own",)))
    assert {record.payload.question: record.payload.scores for record in outcome.records} == {
        "Is there a mug?": {"letters": 3 / 20, "plain": 1.0},
        "Where was the mug before you put it?": {"letters": 10 / 20, "plain": 0.0},
        "What did you put on the table?": {"letters": 10 / 20, "plain": 0.0},
        "Is there a fridge?": {"letters": 2 / 20, "plain": 1.0},
        "Is there a sink?": {"letters": 2 / 20, "plain": 1.0},
    }
    document = json.loads((outcome.folder / "results.json").read_text())
    summary = document["summary"]["tasks"]["nieh_own"]
    assert summary["metrics"] == ["letters", "plain"]
    scores = summary["by_clues"]["total"]["scores"]
    assert {name: score["mean"] for name, score in scores.items()} == {
        "letters": pytest.approx(0.27),
        "plain": 0.6,
    }


def test_tasks_with_and_without_metrics_of_their_own_run_together(prepare_run, own):
    own()
    tasks = execute(prepare_run(tasks=("nieh_gt", "nieh_own"))).summary.summary.tasks
    assert {name: task.metrics for name, task in tasks.items()} == {
        "nieh_gt": ["reference", "strict"],
        "nieh_own": ["letters", "plain"],
    }
    assert tasks["nieh_gt"].by_clues["total"].scores["strict"].mean == 1.0


def test_another_source_of_the_function_is_another_run(prepare_run, own):
    folders = []
    for function in (MEASURE, MEASURE.replace("20", "40"), MEASURE):
        own(function)
        folders.append(execute(prepare_run(tasks=("nieh_own",))).folder)
    assert folders[0] == folders[2] != folders[1]


VALUE = "ValueError in quantities.py:"
BAD_REPLIES = [
    ("{'letters': 1 / 0}", "ZeroDivisionError in own.py:2 (measure)", "division by zero"),
    ("{'letters': 1.0}", "KeyError in metrics.py:", "no 'plain'"),
    ("{'letters': 'many', 'plain': 1}", VALUE, "could not convert string to float: 'many'"),
    ("{'letters': float('nan'), 'plain': 1}", VALUE, "letters is nan"),
    ("{'letters': 1, 'plain': float('inf')}", VALUE, "plain is inf"),
    ("None\nmeasure = 3", "TypeError in metrics.py:", "'int' object is not callable"),
]


@pytest.mark.parametrize(
    ("value", "place", "expected"), BAD_REPLIES, ids=[expected for _, _, expected in BAD_REPLIES]
)
def test_a_function_that_fails_fails_the_sample_by_name_and_place(
    prepare_run, own, value, place, expected
):
    own(f"def measure(doc, results):\n    return {value}\n")
    outcome = execute(prepare_run(tasks=("nieh_own",)))
    assert len(outcome.records) == 5
    for record in outcome.records:
        assert record.failure.startswith(f"process_results fails on {record.id}: {place}")
        assert record.failure.endswith(f": {expected}; traceback in journal/tracebacks.txt")
        assert "\n" not in record.failure
    assert (outcome.folder / "journal" / "tracebacks.txt").read_text().count(
        "attempt 1\nTraceback (most"
    ) == 1
    again = execute(prepare_run(tasks=("nieh_own",)))  # its journal can be read
    assert {record.attempt for record in again.records} == {2}


def test_a_function_that_fails_on_one_reply_costs_one_sample(prepare_run, own):
    own(
        MEASURE.replace(
            "    said,", "    assert 'sink' not in doc['question'], 'no\\nsink'\n    said,"
        )
    )
    outcome = execute(prepare_run(tasks=("nieh_own",)))
    (failed,) = [record for record in outcome.records if record.failure]
    assert failed.payload.question == "Is there a sink?"
    assert "AssertionError in own.py:" in failed.failure
    assert failed.failure.endswith(" (measure): no sink; traceback in journal/tracebacks.txt")
    assert outcome.summary.summary.tasks["nieh_own"].by_clues["total"].n_failed == 1


LIST = OWN[OWN.index("metric_list") :]
CHANGES = [
    ("aggregation: mean", "aggregation: median", "metric_list: letters is not averaged"),
    (LIST, "metric_list: []\n", "names its metrics under metric_list"),
    (LIST, "metric_list: [letters]\n", "metric_list: 'letters' is not a mapping"),
    (LIST, "metric_list: [{aggregation: mean}]\n", "metric_list: .* is not a mapping"),
    ("is_better: true", "is_better: false", "letters is better when lower"),
    ("own.measure", "own.gauge", "process_results own.gauge cannot be imported"),
    ("own.measure", "nowhere_at_all.measure", "nowhere_at_all.measure cannot be imported"),
    ("own.measure", "measure", "process_results measure cannot be imported"),
]
BAD_FILES = [
    *((OWN.replace(old, new), MEASURE, expected) for old, new, expected in CHANGES),
    (OWN, "def measure(:\n", "process_results own.measure cannot be imported"),
    (OWN, "1 / 0\n", "process_results own.measure cannot be imported .*division by zero"),
]


@pytest.mark.parametrize(
    ("content", "function", "expected"), BAD_FILES, ids=[expected for *_, expected in BAD_FILES]
)
def test_a_file_whose_metrics_cannot_be_had_is_refused_in_one_line(
    prepare_run, own, content, function, expected
):
    own(function, content)
    with pytest.raises(DataError, match=expected) as caught:
        prepare_run(tasks=("nieh_own",))
    assert "nieh_own.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_function_that_is_installed_is_found_on_the_path(own):
    own(task=OWN.replace("own.measure", "infthor_eval.nieh.scoring.scores"))
    assert metrics_of(task()).names == ("letters", "plain")


def test_of_our_scorers_a_task_has_those_that_it_lists(own):
    ours = OWN.replace("own.measure", "infthor_eval.harness.nieh_task.process_results")
    own(task=ours.replace(LIST, "metric_list: [{metric: strict}, {metric: reference}]\n"))
    assert metrics_of(task()) == PUBLISHED
    own(task=ours.replace(LIST, "metric_list: [{metric: reference}]\n"))
    assert (metrics_of(task()).names, metrics_of(task()).code) == (("reference",), {})
    own(task=ours)
    with pytest.raises(
        DataError,
        match="letters is none of our scorers, reference, strict; name its process_results",
    ):
        metrics_of(task())
