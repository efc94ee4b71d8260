"""Requests of stored runs, made again: what comes out is what was sent, or an error says that it is
not known."""

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.rescoring.rebuilt_requests import RequestRebuilder
from infthor_eval.nieh.samples import open_set
from infthor_eval.runs.journals.shards import read_run_log
from infthor_eval.storage.folders import packaged_folder

from ...helpers.command_line import option_words

DATA = packaged_folder("sets/nieh_mini")
SIZED = "nieh_haystack_8k,nieh_truncate_head_8k"
TOLD = (
    "nieh_mini_gt,nieh_mini_full,nieh_interleaved,nieh_interleaved_plans,nieh_text_state,nieh_video"
)


@pytest.fixture
def ask(run_cli, tmp_path):
    """Runs the answer key on some tasks and returns the run's header and log."""

    def ask(tasks, *options, model="oracle"):
        words = (
            *option_words(model=model, tasks=tasks, data=DATA, limit="6", out=tmp_path),
            *options,
        )
        assert run_cli(*words)[0] == 0
        (folder,) = (tmp_path / model).iterdir()
        return read_run_log(folder, RECORDS)

    return ask


def rebuilt(header, records):
    rebuilders = {
        task: RequestRebuilder(header, task, open_set(str(DATA))) for task in header.config.tasks
    }
    return [(record, rebuilders[record.task].rebuild(record)) for record in records]


@pytest.mark.parametrize(
    ("tasks", "options"),
    [
        (TOLD, ()),
        (SIZED, ("--tokens-per-frame", "100", "--k-tokens", "1000")),
        ("nieh_mini_full,nieh_interleaved", ("--frames", "blank")),
        ("nieh_mini_full", ("--frames", "shuffled", "--seed", "3")),
        ("nieh_mini_full", ("--frames", "other")),
        ("nieh_mini_gt", ("--repeats", "2", "--temperature", "0.5")),
    ],
)
def test_every_context_comes_out_as_it_was_sent(ask, tasks, options):
    header, log = ask(tasks, *options)
    requests = log.requests
    for record, request in rebuilt(header, log.records):
        assert request.text.endswith(f"Question: {record.payload.question}")
        assert request.context
        shown_clues = record.payload.shown_clues
        stored = requests[record.request]
        assert stored.text(record.payload.question, lambda frames: "<image>" * frames.n) == "".join(
            part if isinstance(part, str) else "<image>"
            for part in (*as_images(request.context), request.text)
        )
        if shown_clues is not None:
            question = next(it for it in open_set(str(DATA)).questions if it.id == record.id)
            shown = {at for first, last in stored.shown for at in range(first, last + 1)}
            assert len(set(question.clues) & shown) == shown_clues.n_shown


def test_what_a_memory_recalled_is_taken_from_the_record(ask):
    header, log = ask("nieh_mini_memory", "--memory", "uniform", model="qwen2.5-vl-nano")
    for record, request in rebuilt(header, log.records):
        assert record.payload.recall is not None
        assert len(request.context) == len(record.payload.recall.recalled) + 1


def test_another_request_than_the_one_sent_is_refused(ask):
    header, log = ask("nieh_mini_gt")
    rebuilder = RequestRebuilder(header, "nieh_mini_gt", open_set(str(DATA)))
    for change in ({"fingerprint": "0" * 32}, {"repeat": 2}):
        with pytest.raises(DataError, match="another request than the one that was sent"):
            rebuilder.rebuild(msgspec.structs.replace(log.records[0], **change))
    for change, why in (
        ({"id": "nobody/1"}, "not in the set"),
        ({"fingerprint": ""}, "could not be read"),
    ):
        with pytest.raises(DataError, match=why):
            rebuilder.rebuild(msgspec.structs.replace(log.records[0], **change))


def test_frames_that_a_model_retrieved_are_not_guessed(ask):
    header, log = ask("nieh_mini_gt")
    header.config.tasks["nieh_mini_gt"].settings["dataset_kwargs"]["context"] = "clip_retrieval"
    with pytest.raises(DataError, match="the journal does not have them"):
        RequestRebuilder(header, "nieh_mini_gt", open_set(str(DATA))).rebuild(log.records[0])
