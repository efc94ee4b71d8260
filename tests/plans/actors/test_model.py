"""Models as actors of plans: scripted ones, and tiny ones with all their layers."""

from dataclasses import replace
from itertools import pairwise

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.actors.model import ModelActor
from infthor_eval.plans.history.forms import LastTokens, history_named
from infthor_eval.plans.history.recalled import MemoryChoice
from infthor_eval.plans.plan import plans_of, tasks_of
from infthor_eval.runs import execute
from model_adapters.backend import BackendConversation

from ...helpers.prompts import join_parts
from ...helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from ..scripting import ScriptedModel, actions_in_prompt, goal_in_prompt, plan_in_prompt

pytestmark = pytest.mark.usefixtures("shared_simulators")

QWEN, LLAVA = "qwen2.5-vl-tiny", "llava-onevision-tiny"
FIRST = "<|goal|>Your main goal: put a fork in the drawer<|goal|>"


def frames(parts):
    return [part for part in parts if isinstance(part, FrameRef)]


def says(outcome):
    return [[step.reply for step in record.payload.steps] for record in outcome.records]


def endings(outcome):
    return [record.payload.ended for record in outcome.records]


@pytest.fixture
def run_scripted(prepare_run, monkeypatch):
    """A run of a scripted model: what it said to whom, and the outcome."""

    def run_scripted(say, **changes):
        model = ScriptedModel(say)
        monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: model)
        return execute(prepare_run(QWEN, **changes)), model

    return run_scripted


def as_expert(folder):
    """Says what the expert did for the plan, by the words of goal and plan and the actions up to
    now."""
    known = {}
    for trajectory in iter_trajectories(folder):
        tasks = tasks_of(trajectory)
        for plan in plans_of(trajectory, Words.PUBLISHED):
            key = tasks[plan.task].text, plan.text
            assert key not in known
            known[key] = expert_texts(trajectory, plan, Words.PUBLISHED)

    def say(parts, decoding):
        return known[goal_in_prompt(parts), plan_in_prompt(parts)][len(actions_in_prompt(parts))]

    return say


@pytest.fixture
def brief(task_files):
    """Plans are over after four actions."""
    (task_files / "plans" / "infthor_plans.yaml").write_text(
        "include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {max_steps: 4}\n"
    )


# -- what a model is asked, and what its words do


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
    beginnings = [parts for parts, _ in model.requests if not actions_in_prompt(parts)]
    whole = FIRST + "<image>"
    for plan, parts in zip(plans, beginnings, strict=True):
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
            assert frames(after)[:-1] == frames(before)
    assert {
        (decoding.max_new_tokens, decoding.temperature, decoding.stop)
        for _, decoding in model.requests
    } == {(10, 1.0, ("<|act|>",))}
    # Each action has draws of its own.
    assert len({decoding.seed for _, decoding in model.requests}) == len(model.requests)
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

    def beginnings(model):
        return [parts for parts, _ in model.requests if not actions_in_prompt(parts)]

    def seen(model):
        return [
            [join_parts(parts), *(frame.digest for frame in frames(parts))]
            for parts in beginnings(model)
        ]

    assert len(seen(right)) == 4
    assert seen(wrong) == seen(right)


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
        assert [sample.reply for sample in outcome.samples] == [reply]


def test_a_reply_with_white_space_around_it_is_the_action_and_goes_into_the_history_without(
    run_scripted, data
):
    _, model = run_scripted(
        lambda parts, _: " RotateRight \n" if len(actions_in_prompt(parts)) < 2 else "", limit=1
    )
    first = [parts for parts, _ in model.requests[:3]]
    assert join_parts(first[2]).endswith(
        "<|act|>RotateRight<|act|><image><|act|>RotateRight<|act|><image><|act|>"
    )


def test_a_model_that_fails_fails_its_plan_alone(run_scripted):
    def say(parts, _):
        if plan_in_prompt(parts) == "pick up the Fork":
            raise ZeroDivisionError("of its own")
        return "RotateLeft" if not actions_in_prompt(parts) else ""

    outcome, _ = run_scripted(say)
    assert [record.failure and record.failure.split(" (")[0] for record in outcome.records] == [
        None,
        f"{QWEN} fails on the request",
        None,
        None,
    ]
    assert outcome.records[1].payload.max_reward == 2


def test_replies_are_held_to_what_is_possible_where_that_is_asked(run_scripted, brief):
    outcome, model = run_scripted(lambda parts, decoding: decoding.choices[-1], constrained=True)
    for _, decoding in model.requests:
        assert {"MoveAhead", "RotateLeft", "NoOp"} <= set(decoding.choices)
        assert decoding.max_new_tokens >= 64
    assert not {"no action", "unknown object", "not in view", "not possible"} & set(
        endings(outcome)
    )


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
    assert all(
        join_parts(parts).startswith(f"You are a robot. {FIRST}<image>")
        for parts, _ in model.requests
    )


def test_grey_frames_take_the_places_of_all(run_scripted, data):
    _, plain = run_scripted(as_expert(data))
    _, blank = run_scripted(as_expert(data), frames="blank")
    assert [join_parts(parts) for parts, _ in blank.requests] == [
        join_parts(parts) for parts, _ in plain.requests
    ]
    assert len({frame.digest for parts, _ in blank.requests for frame in frames(parts)}) == 1
    assert frames(blank.requests[0][0])[0].load().size == (300, 300)


# -- what a model is given of the past


def test_the_last_plans_that_fit_are_whole_and_begin_with_their_goal(run_scripted, tmp_path):
    data = write_trajectories(tmp_path / "six", cut_trajectory(FORK, 6))
    _, full = run_scripted(lambda *_: "", data=data)
    wholes = [join_parts(parts) for parts, _ in full.requests]
    second = "<|goal|>Your main goal: put two slices of tomato on the dining table<|goal|>"
    for limit in (25, 60, 10_000):
        _, model = run_scripted(
            lambda *_: "", data=data, history=f"last:{limit}", output=tmp_path / str(limit)
        )
        for number, (parts, _) in enumerate(model.requests):
            window, whole = join_parts(parts), wholes[number]
            assert count(parts) <= limit
            assert window.endswith("<|plan|><|act|>")
            goal = FIRST if window.startswith(FIRST) else second
            assert window.startswith(f"{goal}<image><|plan|>Plan: ")
            assert whole.endswith(window.removeprefix(f"{goal}<image>"))
            assert whole[: -len(window.removeprefix(f"{goal}<image>"))].endswith("<image>")
            # No more would have fitted: one plan more is too much.
            if window != whole:
                n_shown = window.count("<|plan|>Plan: ")
                segments = whole.split("<|plan|>Plan: ")
                more = f"{FIRST}<image><|plan|>Plan: " + "<|plan|>Plan: ".join(
                    segments[-n_shown - 1 :]
                )
                assert len(more.replace("<image>", " image ").split()) > limit
    assert [join_parts(parts) for parts, _ in model.requests] == wholes


def count(parts):
    return sum(1 if isinstance(part, FrameRef) else len(part.split()) for part in parts)


def test_a_plan_that_does_not_fit_alone_fails_and_says_so(run_scripted):
    outcome, _ = run_scripted(lambda *_: "", history="last:5")
    assert {record.failure for record in outcome.records} == {
        "the plan alone takes more than 5 tokens; give --history last:N a larger N"
    }


def test_tokens_that_nobody_counts_cannot_be_limited(run_scripted, monkeypatch):
    monkeypatch.setattr("tests.plans.scripting.Talk.n_tokens", None)
    outcome, _ = run_scripted(lambda *_: "", history="last:500")
    assert {record.failure for record in outcome.records} == {
        "the model counts no tokens, so --history last:N cannot be used; use full"
    }


def test_the_state_in_words_takes_the_place_of_the_history(run_scripted, tmp_path):
    data = write_trajectories(tmp_path / "six", cut_trajectory(FORK, 6))
    _, model = run_scripted(as_expert(data), data=data, history="text")
    beginnings = [parts for parts, _ in model.requests if not actions_in_prompt(parts)]
    assert [len(frames(parts)) for parts in beginnings] == [1] * 6
    assert join_parts(beginnings[0]).startswith(f"{FIRST} State: ")
    for parts, plan in zip(beginnings, ("go to the cabinet", "pick up the Fork"), strict=False):
        assert join_parts(parts).endswith(
            f"; Last agent's view: <image><|plan|>Plan: {plan}<|plan|><|act|>"
        )
    assert "fork" in join_parts(beginnings[3]).partition("State: ")[2].lower()  # it is in the hand
    assert join_parts(beginnings[4]).startswith("<|goal|>Your main goal: put two slices of tomato")
    assert beginnings[1][1].digest != beginnings[0][1].digest


def test_the_frames_nearest_to_the_present_one_are_shown_in_time_order(
    run_scripted, data, make_clip
):
    _, full = run_scripted(as_expert(data))
    histories = [frames(parts) for parts, _ in full.requests if not actions_in_prompt(parts)]
    _, model = run_scripted(as_expert(data), history="frames:3", retriever=str(make_clip()))
    beginnings = [parts for parts, _ in model.requests if not actions_in_prompt(parts)]
    for parts, history in zip(beginnings, histories, strict=True):
        earlier, now = [frame.digest for frame in history[:-1]], history[-1].digest
        *digests, present = [frame.digest for frame in frames(parts)]
        assert present == now
        assert len(digests) == min(3, len(earlier))
        rest = iter(earlier)
        assert all(frame in rest for frame in digests)
        assert join_parts(parts).startswith("<image>" * len(digests) + FIRST + "<image><|plan|>")


THERE_ARE = (
    "there are full, published, last:TOKENS, text, retrieved:K, frames:K, memory, goals and plans"
)
BAD_HISTORIES = (
    *("last:0", "last:", "last:-5", "last:many", "last:²"),
    *("frames:0", "all", "full:3", "text:3"),
)


@pytest.mark.parametrize("history", BAD_HISTORIES)
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


# -- tiny models


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
        firsts = [
            reply.n_context_tokens for parts, reply in watched if not actions_in_prompt(parts)
        ]
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


def test_a_model_that_loses_its_conversation_is_an_error(run_scripted, monkeypatch):
    def full(*_):
        raise ModelError("too long")

    monkeypatch.setattr("infthor_eval.plans.history.forms.FullHistory.recall", full)
    outcome, _ = run_scripted(lambda *_: "")
    assert {record.failure for record in outcome.records} == {"too long"}


def test_a_memory_stands_in_for_the_history(run_scripted, data):
    _, full = run_scripted(as_expert(data))
    _, model = run_scripted(as_expert(data), history="memory", memory="last", memory_args="k=2")
    histories, beginnings = (
        [parts for parts, _ in model_requests if not actions_in_prompt(parts)]
        for model_requests in (full.requests, model.requests)
    )
    for history, beginning in zip(histories, beginnings, strict=True):
        seen = [frame.digest for frame in frames(history)]
        digests = [frame.digest for frame in frames(beginning)]
        assert digests[-1] == seen[-1]
        assert len(digests) <= 3
        assert set(digests) <= set(seen)
