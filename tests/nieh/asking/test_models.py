"""Models are asked by trajectory and in batches; a unit that fails takes no other with it."""

from collections import Counter

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.runs import execute
from model_adapters import Capabilities, Reply, Transcript
from tests.model_adapters.toy_adapter import Toy

from ..watching import Watcher, replies

TINY = "qwen2.5-vl-tiny"


class Recorder(Toy):
    """A scripted model that keeps what it was asked."""

    name, capabilities = "recorder", Capabilities(token_ids=False)

    def __init__(self):
        self.requests = []

    def tokens_per_frame(self, frame):
        return 100

    def conversation(self):
        return RecordedTalk(self)


class RecordedTalk(Transcript):
    def __init__(self, model):
        super().__init__()
        self.model = model

    @property
    def n_tokens(self):
        return sum(len(turn.parts) for turn in self.turns)

    def reply(self, decoding):
        assert (decoding.max_new_tokens, decoding.greedy, decoding.stop) == (50, True, ())
        ((*frames, text),) = (turn.parts for turn in self.turns)
        self.model.requests.append([*frames, text])
        for frame in frames:
            frame.load()
        n_tokens = {"n_reply_tokens": 2, "n_context_tokens": len(frames) + 1, "n_cached_tokens": 0}
        return Reply("first line\nmug", **n_tokens)


@pytest.fixture
def recorder(monkeypatch):
    """Takes the place of the tiny model."""
    model = Recorder()
    monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: model)
    return model


def test_a_model_is_asked_by_trajectory_and_in_the_published_words(prepare_run, recorder):
    outcome = execute(prepare_run(TINY, tasks=("nieh_full",)))
    names = [[part.path.parts[-3] for part in parts[:-1]] for parts in recorder.requests]
    assert names == [["traj_a"] * 6] * 3 + [["traj_b"] * 6] * 2
    assert recorder.requests[0][-1] == (
        "\n"
        "Answer the question given the agent's views in time order. Do not include explanation "
        "or reasoning in the answer. Answer with a single word or words.\n"
        "Question: Is there a mug?"
    )
    assert set(replies(outcome).values()) == {"first line\nmug"}
    assert {
        (record.tokens.context, record.tokens.cached, record.tokens.reply)
        for record in outcome.records
    } == {(7, 0, 2)}


def test_a_unit_that_fails_is_recorded_and_tried_again_by_the_next_run(prepare_run, recorder, data):
    frame = data / "metadata" / "traj_a" / "img" / "000000001.png"
    whole = frame.read_bytes()
    # Its size is part of the set's fingerprint.
    frame.write_bytes(whole[:60] + bytes(len(whole) - 60))
    first = execute(prepare_run(TINY)).records
    failed = {record.key: record.failure for record in first if record.failure}
    assert len(first) == 10
    assert Counter(key.task for key in failed) == {"nieh_gt": 2, "nieh_full": 3}
    assert all(str(frame) in failure for failure in failed.values())
    frame.write_bytes(whole)
    watcher = Watcher()
    outcome = execute(prepare_run(TINY), watcher)
    assert {record.key for record in watcher.evaluated} == failed.keys()
    assert {record.attempt for record in watcher.evaluated} == {2}
    assert not any(record.failure for record in outcome.records)


def test_batches_give_the_same_replies_and_one_that_fails_takes_no_other_with_it(
    prepare_run, monkeypatch
):
    tasks = ("nieh_full",)
    alone = execute(prepare_run(TINY, tasks=tasks))
    together = execute(prepare_run(TINY, {"batch_size": "4"}, tasks=tasks))
    assert replies(together) == replies(alone)
    assert not any(record.faults for record in together.records)

    from model_adapters.backend import BackendConversation

    whole = BackendConversation.replies

    def one_at_a_time(talk, continuations, decoding):
        if len(continuations) > 1:
            raise ModelError("out of memory on a batch")
        return whole(talk, continuations, decoding)

    monkeypatch.setattr(BackendConversation, "replies", one_at_a_time)
    with_retries = execute(prepare_run(TINY, {"batch_size": "3"}, tasks=tasks))
    assert replies(with_retries) == replies(alone)
    assert Counter(record.faults for record in with_retries.records) == {
        ("asked with 2 others: out of memory on a batch",): 3,
        ("asked with 1 others: out of memory on a batch",): 2,
    }


def test_one_of_a_batch_that_cannot_be_answered_fails_alone(prepare_run, monkeypatch):
    from model_adapters.backend import BackendConversation

    whole = BackendConversation.replies

    def but_the_sink(talk, continuations, decoding):
        if any("sink" in parts[-1] for parts in continuations):
            raise ModelError("no sink, please")
        return whole(talk, continuations, decoding)

    monkeypatch.setattr(BackendConversation, "replies", but_the_sink)
    outcome = execute(prepare_run(TINY, {"batch_size": "4"}, tasks=("nieh_full",)))
    (failed,) = [record for record in outcome.records if record.failure]
    assert failed.payload.question == "Is there a sink?"
    assert failed.failure == "no sink, please"
    assert failed.faults == ("asked with 1 others: no sink, please",)


def test_a_model_that_counts_no_tokens_is_asked_once_the_size_of_a_frame_is_told(
    prepare_run, recorder, monkeypatch
):
    monkeypatch.setattr(
        Recorder, "capabilities", Capabilities(counts_tokens=False, token_ids=False)
    )
    monkeypatch.setattr(Recorder, "tokens_per_frame", lambda *_: None)
    tasks = ("nieh_truncate_head_8k",)
    with pytest.raises(UsageError, match="which recorder does not count; give --tokens-per-frame"):
        execute(prepare_run(TINY, tasks=tasks))
    watcher = Watcher()
    execute(prepare_run(TINY, tasks=tasks, suite_options={"tokens_per_frame": 2000}), watcher)
    assert {len(parts) for parts in recorder.requests} == {8192 // 2000 + 1}
    assert watcher.work.costs == []
