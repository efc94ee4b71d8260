"""Tiny models act, with all their layers."""

from dataclasses import replace
from itertools import pairwise

import pytest

from infthor_eval.plans.actors.model import ModelActor
from infthor_eval.runs import execute
from model_adapters.backend import BackendConversation

from ...helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from ..outcomes import endings, says
from ..scripting import actions_in_prompt

pytestmark = pytest.mark.usefixtures("shared_simulators")

QWEN, LLAVA = "qwen2.5-vl-tiny", "llava-onevision-tiny"


@pytest.fixture
def watched(monkeypatch):
    """Keeps the replies of tiny models, with what they were made from."""
    seen, reply = [], BackendConversation.reply

    def kept(talk, decoding):
        answer = reply(talk, decoding)
        seen.append((list(talk.turns[-1].parts), answer))
        return answer

    monkeypatch.setattr(BackendConversation, "reply", kept)
    return seen


@pytest.fixture
def short(tmp_path):
    """Two plans of a few actions."""
    return write_trajectories(tmp_path / "short", cut_trajectory(CANDLE, 2))


@pytest.mark.parametrize(
    ("model", "ways"), [(QWEN, ("greedy", "constrained")), (LLAVA, ("constrained",))]
)
def test_sharing_what_was_encoded_changes_no_reply(
    prepare_run, tmp_path, short, brief, model, ways
):
    for way in ways:  # replies are drawn unless they are greedy
        shared, plain = (
            execute(prepare_run(model, options, data=short, **{way: True}))
            for options in ({}, {"share_prefix": "false"})
        )
        assert shared.folder != plain.folder
        assert not any(record.failure for record in (*shared.records, *plain.records))
        assert says(shared) == says(plain)
        assert endings(shared) == endings(plain)


def test_a_seed_draws_the_same_replies_and_another_others(prepare_run, tmp_path):
    data = write_trajectories(tmp_path / "one", cut_trajectory(FORK, 3))

    def drawn(seed, folder):
        return says(execute(prepare_run(QWEN, data=data, seed=seed, output=tmp_path / folder)))

    first = drawn(0, "a")
    assert drawn(0, "b") == first
    assert drawn(1, "c") != first
    greedy = says(execute(prepare_run(QWEN, data=data, greedy=True, output=tmp_path / "greedy")))
    assert greedy != first


def test_replies_that_are_held_to_possible_actions_can_be_tried(prepare_run, short, brief):
    outcome = execute(prepare_run(QWEN, data=short, constrained=True))
    steps = [step for record in outcome.records for step in record.payload.steps]
    assert all(step.action == step.reply for step in steps)
    assert all(step.call for step in steps)
    assert set(endings(outcome)) <= {"done", "refused by the simulator", "step limit"}


@pytest.mark.parametrize("model", [QWEN, LLAVA])
def test_what_was_seen_is_encoded_once(prepare_run, short, monkeypatch, watched, brief, model):
    """The model turns about: nothing that it saw before an action is encoded again for the next."""
    act = ModelActor.act
    monkeypatch.setattr(ModelActor, "act", lambda actor: replace(act(actor), action="RotateLeft"))
    execute(prepare_run(model, {"chunk_tokens": "64"}, data=short, greedy=True))
    assert [len(actions_in_prompt(parts)) for parts, _ in watched] == [0, 1, 2, 3] * 2
    for number, ((_, first), (_, second)) in enumerate(pairwise(watched), 1):
        if number != 4:
            # All but the end of the prompt, where the reply was asked for, is there.
            assert first.n_context_tokens - second.n_cached_tokens < 30
        else:  # the next plan: what is the same history
            assert watched[0][1].n_context_tokens - second.n_cached_tokens < 30


def test_histories_of_a_tiny_model(prepare_run, tmp_path, watched, make_clip):
    data = write_trajectories(tmp_path / "few", cut_trajectory(CANDLE, 5))
    options = {"retriever": str(make_clip())}
    for history, more in (("full", {}), ("last:700", {}), ("text", {}), ("frames:2", options)):
        watched.clear()
        outcome = execute(prepare_run(QWEN, data=data, greedy=True, history=history, **more))
        assert not any(record.failure for record in outcome.records)
        begun = [reply for parts, reply in watched if not actions_in_prompt(parts)]
        firsts = [reply.n_context_tokens for reply in begun]
        assert len(firsts) == len(outcome.records) == 4  # one of five belongs to no task
        if history == "full":
            whole = firsts
        if history == "last:700":
            assert max(firsts) <= 700 < max(whole)
        assert [record.payload.steps[0].n_context_tokens for record in outcome.records] == firsts


def test_a_context_that_is_full_fails_the_plan_in_one_line(prepare_run, short):
    outcome = execute(prepare_run(QWEN, {"max_tokens": "200"}, data=short))
    first, second = outcome.records
    assert second.failure
    assert "200" in second.failure
    assert "\n" not in second.failure
    assert first.payload.max_reward is not None
