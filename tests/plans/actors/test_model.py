"""What a model is asked to act upon, and what its words do."""

from itertools import pairwise

import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.plan import plans_of
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run
from infthor_eval.runs import StoredFrames

from ...helpers.prompts import join_parts
from ...helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from ..outcomes import endings
from ..scripting import (
    FIRST_GOAL,
    ScriptedModel,
    actions_in_prompt,
    as_expert,
    beginnings,
    frames_in_prompt,
    plan_in_prompt,
    prompts,
)

pytestmark = pytest.mark.usefixtures("shared_simulators")

QWEN = "qwen2.5-vl-tiny"


def test_the_experts_own_words_carry_every_plan_out(run_scripted, tmp_path):
    """Ten cabinets and drawers, two candles: the words mean the plan's own."""
    folder = write_trajectories(
        tmp_path / "two", cut_trajectory(FORK, 6), cut_trajectory(CANDLE, 4)
    )
    outcome, model = run_scripted(as_expert(folder), data=folder)
    assert set(endings(outcome)) == {"done"}
    assert all(record.payload.reward == record.payload.max_reward for record in outcome.records)
    assert len(model.requests) == sum(len(record.payload.steps) for record in outcome.records)


def test_a_model_reads_the_sequence_that_it_was_trained_on(run_scripted, data):
    outcome, model = run_scripted(as_expert(data))
    (trajectory,) = iter_trajectories(data)
    plans = plans_of(trajectory, Words.PUBLISHED)
    whole = FIRST_GOAL + "<image>"
    for plan, parts in zip(plans, beginnings(model), strict=True):
        assert join_parts(parts) == f"{whole}<|plan|>Plan: {plan.text}<|plan|><|act|>"
        whole += f"<|plan|>Plan: {plan.text}<|plan|>"
        whole += "".join(
            f"<|act|>{action}<|act|><image>"
            for action in expert_texts(trajectory, plan, Words.PUBLISHED)
        )
    for (before, _), (after, _) in pairwise(model.requests):
        if actions_in_prompt(after):  # within a plan it grows by the action and what is seen then
            action = actions_in_prompt(after)[-1]
            assert join_parts(after) == f"{join_parts(before)}{action}<|act|><image><|act|>"
            assert frames_in_prompt(after)[:-1] == frames_in_prompt(before)
    decodings = [decoding for _, decoding in model.requests]
    assert {(it.max_new_tokens, it.temperature, it.stop) for it in decodings} == {
        (10, 1.0, ("<|act|>",))
    }
    # Each action has draws of its own.
    assert len({decoding.seed for decoding in decodings}) == len(decodings)
    tokens = [record.tokens for record in outcome.records]
    assert [(count.reply, count.cached) for count in tokens] == [
        (len(record.payload.steps), 0) for record in outcome.records
    ]


def test_the_history_is_the_true_one_whatever_the_model_did(run_scripted, data, tmp_path):
    _, right = run_scripted(as_expert(data))
    _, wrong = run_scripted(
        lambda parts, decoding: "RotateLeft" if not actions_in_prompt(parts) else "",
        output=tmp_path / "b",
    )

    def seen(model):
        return [
            [join_parts(parts), *(frame.digest for frame in frames_in_prompt(parts))]
            for parts in beginnings(model)
        ]

    assert len(seen(right)) == 4
    assert seen(wrong) == seen(right)


def test_the_journal_has_what_was_asked_before_each_plan_once(run_scripted, data):
    outcome, model = run_scripted(as_expert(data))
    run = Run.open(outcome.folder)
    requests = [Sample(run, record).request_text(lambda _: "<image>") for record in run.records]
    assert [f"{request}<|act|>" for request in requests] == list(map(join_parts, beginnings(model)))
    stored = [run.requests(record)[-1] for record in run.records]
    frames = [part.places for it in stored for part in it.parts if isinstance(part, StoredFrames)]
    assert frames == [((place, place),) for place in range(len(frames))]
    assert [bool(request.after) for request in stored] == [False, True, True, True]


FAULTS = [
    ("", "no action", "empty action"),
    ("  \n", "no action", "empty action"),
    ("I would go ahead", "no action", "unknown action 'I'"),
    ("moveahead", "no action", "unknown action 'moveahead'"),
    ("MoveAhead Fork", "no action", "MoveAhead takes 0 object types, got 1"),
    ("PutObject Fork", "no action", "PutObject takes 2 object types, got 1"),
    ("PickupObject Unicorn", "unknown object", "Unicorn: none in this scene"),
    ("PickupObject Fork", "not in view", "Fork: none in sight"),
    ("PutObject Fork Cabinet", "not possible", "no Fork in the hand"),
]


def test_replies_that_are_no_action_here_are_counted_by_their_fault(run_scripted, tmp_path):
    data = write_trajectories(tmp_path / "one", cut_trajectory(FORK, 1))
    for number, (reply, ended, message) in enumerate(FAULTS):
        outcome, model = run_scripted(
            lambda *_, text=reply: text, data=data, output=tmp_path / str(number)
        )
        (record,) = outcome.records
        assert outcome.summary.summary.tasks["infthor_plans"].endings == {ended: 1}
        (step,) = record.payload.steps
        assert (step.reply, step.action, step.call, step.reward) == (reply, "", None, 0)
        assert step.message.endswith(message)
        assert len(model.requests) == 1
        assert [doc.reply for doc in outcome.docs] == [reply]


def test_a_reply_with_white_space_around_it_is_the_action_and_goes_into_the_history_without(
    run_scripted, data
):
    _, model = run_scripted(
        lambda parts, _: " RotateRight \n" if len(actions_in_prompt(parts)) < 2 else "", limit=1
    )
    assert prompts(model)[2].endswith("<|act|>RotateRight<|act|><image>" * 2 + "<|act|>")


def test_a_model_that_fails_fails_its_plan_alone(run_scripted):
    def say(parts, _):
        if plan_in_prompt(parts) == "pick up the Fork":
            raise ZeroDivisionError("of its own")
        return "RotateLeft" if not actions_in_prompt(parts) else ""

    outcome, _ = run_scripted(say)
    failures = [record.failure and record.failure.split(" (")[0] for record in outcome.records]
    assert failures == [None, f"{QWEN} fails on the request", None, None]
    assert outcome.records[1].payload.max_reward == 2


def test_replies_are_held_to_what_is_possible_where_that_is_asked(run_scripted, brief):
    outcome, model = run_scripted(lambda parts, decoding: decoding.choices[-1], constrained=True)
    for _, decoding in model.requests:
        assert {"MoveAhead", "RotateLeft", "NoOp"} <= set(decoding.choices)
        assert decoding.max_new_tokens >= 64
    faults = {ended for _, ended, _ in FAULTS}
    assert not faults & set(endings(outcome))


@pytest.mark.parametrize(("trained", "n_warnings"), [("natural", 1), ("published", 0), (None, 0)])
def test_a_checkpoint_that_was_trained_on_other_words_is_told_of(prepare_run, trained, n_warnings):
    run, model = prepare_run(QWEN), ScriptedModel(lambda *_: "")
    model.identity = lambda: {} if trained is None else {"trained_words": trained}
    warnings = run.evaluation.bind(model).workload.warnings
    assert len(warnings) == n_warnings
    assert all(
        text.endswith("is asked in published ones; give --words natural") for text in warnings
    )


@pytest.mark.parametrize("words", ["published", "natural"])
def test_plans_and_actions_are_in_the_words_that_are_asked_for(run_scripted, data, words):
    (trajectory,) = iter_trajectories(data)
    plans = plans_of(trajectory, Words(words))
    known = {plan.text: expert_texts(trajectory, plan, Words(words)) for plan in plans}
    outcome, model = run_scripted(
        lambda parts, _: known[plan_in_prompt(parts)][len(actions_in_prompt(parts))], words=words
    )
    assert set(endings(outcome)) == {"done"}
    assert {plan_in_prompt(parts) for parts, _ in model.requests} == set(known)
    assert [record.payload.plan for record in outcome.records] == list(known)


def test_a_preamble_is_told_before_everything_else(run_scripted, task_files, data):
    (task_files / "plans" / "infthor_plans.yaml").write_text(
        "include: _plans.yaml\n"
        "task: infthor_plans\n"
        "dataset_kwargs: {preamble: 'You are a robot. '}\n"
    )
    _, model = run_scripted(lambda *_: "")
    begin = f"You are a robot. {FIRST_GOAL}<image>"
    assert all(prompt.startswith(begin) for prompt in prompts(model))


def test_grey_frames_take_the_places_of_all(run_scripted, data):
    _, plain = run_scripted(as_expert(data))
    outcome, blank = run_scripted(as_expert(data), frames="blank")
    run = Run.open(outcome.folder)
    assert prompts(blank) == prompts(plain)
    shown = [frame for parts, _ in blank.requests for frame in frames_in_prompt(parts)]
    assert len({frame.digest for frame in shown}) == 1
    assert frames_in_prompt(blank.requests[0][0])[0].load().size == (300, 300)
    told = [Sample(run, record).request_text(repr) for record in run.records]
    assert all("frames (blank)" in text for text in told)
