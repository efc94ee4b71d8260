"""The tasks that ask as the published rows were made."""

import pytest

from infthor_eval.formats.published import published_tables
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.docs import doc_of, doc_prompt
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.rescoring.rebuilt_requests import RequestRebuilder
from infthor_eval.nieh.samples import find_samples, open_set
from infthor_eval.runs import Catalog, execute
from infthor_eval.storage.folders import packaged_folder

from ...conftest import QUESTIONS

BUNDLED = packaged_folder("sets/nieh_mini")
MODELS = pytest.mark.parametrize("model", ["qwen2.5-vl-tiny", "llava-onevision-tiny"])


def settings(name):
    return Catalog.find_packaged().tasks[name].settings["dataset_kwargs"]


def test_every_published_row_of_whole_questions_has_a_task_in_its_context():
    catalog = Catalog.find_packaged()
    rows = {}
    for table in published_tables("nieh"):
        rows |= {row.task: table.context for row in table.rows if table.title != "Table 4"}
    assert None not in rows
    for name, context in rows.items():
        tasks = catalog.expand([name])
        assert {task.settings["dataset_kwargs"]["context"] for task in tasks} == {context}, name
        assert {item["metric"] for task in tasks for item in task.settings["metric_list"]} == {
            "reference"
        }
    published = {
        name for name in (*catalog.tasks, *catalog.groups) if name.startswith("nieh_published_")
    }
    assert set(rows) == published


# Frames of a window as the README and the logs have them: 32K and 64K of 1,024 tokens each, 121 and
# 1,485 a frame.
@pytest.mark.parametrize(
    ("task", "tokens_per_frame", "n"),
    [
        ("last_32k", 121, 270),
        ("last_64k", 121, 541),
        ("last_32k", 1485, 22),
        ("last_64k", 1485, 44),
    ],
)
def test_windows_have_the_published_number_of_frames(make_nieh_set, task, tokens_per_frame, n):
    data = make_nieh_set(n_frames=600, size=8)
    of_task = settings(f"nieh_published_{task}")
    samples = find_samples(
        {**of_task, "data": str(data), "tokens_per_frame": tokens_per_frame}
    ).samples
    assert {sample.frames for sample in samples} == {tuple(range(600 - n, 600))}


def ask(prepare_run, model, task, **options):
    """Asks a question on the bundled set; returns its record."""
    run = prepare_run(
        model, tasks=(f"nieh_published_{task}",), data=BUNDLED, limit=1, suite_options=options
    )
    (record,) = execute(run).records
    return record


def check(record, n_tokens):
    assert record.failure is None
    assert set(record.payload.scores) == {"reference"}
    # A text of about a hundred tiny tokens.
    assert record.tokens.context == pytest.approx(n_tokens, abs=150)


@MODELS
@pytest.mark.parametrize(("task", "n"), [("last_32k", 2), ("last_64k", 4)])
def test_windows_run_on_tiny_models(prepare_run, model, task, n):
    record = ask(prepare_run, model, task, tokens_per_frame=16384)
    check(record, n * {"qwen2.5-vl-tiny": 123, "llava-onevision-tiny": 1485}[model])


@MODELS
@pytest.mark.parametrize(("task", "n"), [("clip_10", 10), ("clip_20", 20)])
def test_retrieved_frames_run_on_tiny_models(prepare_run, make_clip, model, task, n):
    record = ask(prepare_run, model, task, retriever=str(make_clip()))
    check(record, n * {"qwen2.5-vl-tiny": 123, "llava-onevision-tiny": 1485}[model])


@pytest.mark.parametrize(("task", "n_frames"), [("video_1fps", 8), ("video_2fps", 16)])
def test_films_run_on_a_tiny_model(prepare_run, task, n_frames):
    check(ask(prepare_run, "qwen2.5-vl-tiny", task), n_frames // 2 * 144)


def test_whole_trajectories_run_where_they_fit_and_are_refused_where_they_do_not(prepare_run):
    """As in the README: "fail to handle long contexts beyond their pretraining limits"."""
    check(ask(prepare_run, "qwen2.5-vl-tiny", "full"), 89 * 123)
    refused = ask(prepare_run, "llava-onevision-tiny", "readme")
    assert refused.task == "nieh_published_full"
    assert "is beyond the 32768 tokens of llava-onevision-tiny" in refused.failure


# -- the option


def first_prompt(prepare_run, **options):
    """The prompt of the first request as lm-eval's files tell it, and the run."""
    outcome = execute(prepare_run(**options))
    return next(outcome.docs).prompt.rpartition("<image>")[2], outcome


def test_the_option_sets_the_words_and_the_runs_identity(prepare_run, data):
    default, without = first_prompt(prepare_run)
    same, named = first_prompt(prepare_run, suite_options={"prompt": "published-main"})
    other, logs = first_prompt(prepare_run, suite_options={"prompt": "published-logs"})
    assert default == same == question_text(CONTEXTS["clues"].intro, QUESTIONS[0])
    assert other == question_text("", QUESTIONS[0], "published-logs")
    assert named.folder == without.folder != logs.folder
    config = logs.summary.header.config
    assert config.prompt == "published-logs" and without.summary.header.config.prompt is None
    record = logs.records[0]
    rebuilt = RequestRebuilder(logs.summary.header, record.task, open_set(str(data))).rebuild(
        record
    )
    assert rebuilt.text == question_text(
        "", Question("", record.payload.question, (), ()), "published-logs"
    )


def test_lm_evals_docs_keep_the_words(make_nieh_set):
    data = make_nieh_set(size=8)
    samples = find_samples({"context": "trajectory", "data": str(data), "prompt": "published-logs"})
    prompt = doc_prompt(doc_of(samples, samples.samples[0]))
    assert prompt == "<image>" * 6 + question_text(
        "", samples.samples[0].question, "published-logs"
    )
