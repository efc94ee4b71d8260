"""What a model is given of the past."""

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.plans.history.forms import LastTokens, history_named
from infthor_eval.plans.history.recalled import MemoryChoice

from ...helpers.prompts import join_parts
from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ..scripting import (
    FIRST_GOAL,
    as_expert,
    beginnings,
    count_tokens,
    frames_in_prompt,
    prompts,
)

pytestmark = pytest.mark.usefixtures("shared_simulators")


def test_the_last_plans_that_fit_are_whole_and_begin_with_their_goal(run_scripted, tmp_path):
    data = write_trajectories(tmp_path / "six", cut_trajectory(FORK, 6))
    _, full = run_scripted(lambda *_: "", data=data)
    wholes = prompts(full)
    second = "<|goal|>Your main goal: put two slices of tomato on the dining table<|goal|>"
    for limit in (25, 60, 10_000):
        _, model = run_scripted(
            lambda *_: "", data=data, history=f"last:{limit}", output=tmp_path / str(limit)
        )
        for number, (parts, _) in enumerate(model.requests):
            window, whole = join_parts(parts), wholes[number]
            assert count_tokens(parts) <= limit
            assert window.endswith("<|plan|><|act|>")
            goal = FIRST_GOAL if window.startswith(FIRST_GOAL) else second
            assert window.startswith(f"{goal}<image><|plan|>Plan: ")
            assert whole.endswith(window.removeprefix(f"{goal}<image>"))
            assert whole[: -len(window.removeprefix(f"{goal}<image>"))].endswith("<image>")
            # No more would have fitted: one plan more is too much.
            if window != whole:
                n_shown = window.count("<|plan|>Plan: ")
                segments = whole.split("<|plan|>Plan: ")
                more = "<|plan|>Plan: ".join([f"{FIRST_GOAL}<image>", *segments[-n_shown - 1 :]])
                assert len(more.replace("<image>", " image ").split()) > limit
    assert prompts(model) == wholes


def test_a_plan_that_does_not_fit_alone_and_tokens_that_nobody_counts_fail_and_say_so(
    run_scripted, monkeypatch, tmp_path
):
    too_long = "the plan alone takes more than 5 tokens; give --history last:N a larger N"
    outcome, _ = run_scripted(lambda *_: "", history="last:5")
    assert {record.failure for record in outcome.records} == {too_long}
    monkeypatch.setattr("tests.plans.scripting.Talk.n_tokens", None)
    uncounted = "the model counts no tokens, so --history last:N cannot be used; use full"
    outcome, _ = run_scripted(lambda *_: "", history="last:500", output=tmp_path / "other")
    assert {record.failure for record in outcome.records} == {uncounted}


def test_the_state_in_words_takes_the_place_of_the_history(run_scripted, tmp_path):
    data = write_trajectories(tmp_path / "six", cut_trajectory(FORK, 6))
    _, model = run_scripted(as_expert(data), data=data, history="text")
    asked = beginnings(model)
    texts = list(map(join_parts, asked))
    assert [len(frames_in_prompt(parts)) for parts in asked] == [1] * 6
    assert texts[0].startswith(f"{FIRST_GOAL} State: ")
    for text, plan in zip(texts, ("go to the cabinet", "pick up the Fork"), strict=False):
        assert text.endswith(f"; Last agent's view: <image><|plan|>Plan: {plan}<|plan|><|act|>")
    assert "fork" in texts[3].partition("State: ")[2].lower()  # it is in the hand
    assert texts[4].startswith("<|goal|>Your main goal: put two slices of tomato")
    assert asked[1][1].digest != asked[0][1].digest


def test_the_frames_nearest_to_the_present_one_are_shown_in_time_order(
    run_scripted, data, make_clip
):
    _, full = run_scripted(as_expert(data))
    histories = list(map(frames_in_prompt, beginnings(full)))
    _, model = run_scripted(as_expert(data), history="frames:3", retriever=str(make_clip()))
    for parts, history in zip(beginnings(model), histories, strict=True):
        earlier, now = [frame.digest for frame in history[:-1]], history[-1].digest
        *digests, present = [frame.digest for frame in frames_in_prompt(parts)]
        assert present == now
        assert len(digests) == min(3, len(earlier))
        rest = iter(earlier)
        assert all(frame in rest for frame in digests)
        begin = "<image>" * len(digests) + FIRST_GOAL
        assert join_parts(parts).startswith(f"{begin}<image><|plan|>")


THERE_ARE = (
    "there are full, published, last:TOKENS, text, retrieved:K, frames:K, memory, goals and plans"
)
BAD_HISTORIES = "last:0 last: last:-5 last:many last:² frames:0 all full:3 text:3"


@pytest.mark.parametrize("history", BAD_HISTORIES.split())
def test_a_history_that_there_is_not_is_refused(prepare_run, history):
    with pytest.raises(UsageError, match=THERE_ARE) as caught:
        prepare_run("random", history=history)
    assert str(caught.value).startswith(f"--history {history}: ")


def test_a_retriever_is_for_frames_alone_and_must_be_there(prepare_run):
    with pytest.raises(
        UsageError,
        match="--history full retrieves no frames; leave it out, or use --history frames:K",
    ):
        prepare_run("random", retriever="somewhere")
    with pytest.raises(UsageError, match=r"--retriever \./nowhere: there is no such folder"):
        prepare_run("random", history="frames:2", retriever="./nowhere")
    assert isinstance(history_named("last:7", MemoryChoice()), LastTokens)


def test_a_model_that_loses_its_conversation_is_an_error(run_scripted, monkeypatch):
    def full(*_):
        raise ModelError("too long")

    monkeypatch.setattr("infthor_eval.plans.history.forms.FullHistory.recall", full)
    outcome, _ = run_scripted(lambda *_: "")
    assert {record.failure for record in outcome.records} == {"too long"}


def test_a_memory_stands_in_for_the_history(run_scripted, data):
    _, full = run_scripted(as_expert(data))
    _, model = run_scripted(as_expert(data), history="memory", memory="last", memory_args="k=2")
    for history, beginning in zip(beginnings(full), beginnings(model), strict=True):
        seen = [frame.digest for frame in frames_in_prompt(history)]
        digests = [frame.digest for frame in frames_in_prompt(beginning)]
        assert digests[-1] == seen[-1]
        assert len(digests) <= 3
        assert set(digests) <= set(seen)
