"""Final tasks in one go, as the published scripts run them."""

import json

import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.plan import plans_of
from infthor_eval.runs import execute

from ...helpers.prompts import join_parts
from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ..scripting import ScriptedModel

pytestmark = pytest.mark.usefixtures("shared_simulators")

QWEN = "qwen2.5-vl-tiny"
FIRST = "<|goal|>Your main goal: put a fork in the drawer<|goal|><image>"


@pytest.fixture
def final(tmp_path):
    """A kitchen whose final task has two plans, after a task of four."""
    return write_trajectories(tmp_path / "final", cut_trajectory(FORK, 6, final=True))


@pytest.fixture
def experts(final):
    """The expert's actions of each plan, in words."""
    (trajectory,) = iter_trajectories(final)
    return [
        expert_texts(trajectory, plan, Words.PUBLISHED)
        for plan in plans_of(trajectory, Words.PUBLISHED)
    ]


@pytest.fixture
def run_scripted(prepare_run, monkeypatch, final):
    """Runs a model that says these texts one after the other; gives the payloads and the model."""

    def run_scripted(replies, **changes):
        rest = iter(replies)
        model = ScriptedModel(lambda *_: next(rest))
        monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: model)
        settings = {
            "tasks": ("infthor_final",),
            "data": final,
            "protocol": "published",
            "rewards": "published",
        }
        outcome = execute(prepare_run(QWEN, **settings | changes))
        return [record.payload for record in outcome.records], model, outcome

    return run_scripted


def test_the_interleaved_form_ends_after_its_first_plan(run_scripted, experts):
    (first, second), model, outcome = run_scripted(experts[4])
    assert (first.ended, second.ended) == ("done", "not attempted")
    (task,) = outcome.summary.summary.tasks.values()
    assert (task.n_plans, task.n_tried, task.success["total"].mean) == (2, 1, 0.5)
    parts, decoding = model.requests[0]
    prompt = join_parts(parts)
    assert prompt.startswith(f"{FIRST}<|act|><|act|>")
    assert "<|plan|>" not in prompt
    assert prompt.count("<|goal|>Your main goal: ") == 2
    assert prompt.endswith("<|goal|><image><|act|>")
    frames = [part for part in parts if isinstance(part, FrameRef)]
    assert frames[0].digest == frames[-1].digest  # the scene's first frame stands behind each goal
    assert (decoding.max_new_tokens, decoding.temperature, decoding.stop) == (32, 0.0, ("<|act|>",))
    assert decoding.repetition_penalty is None
    assert [
        system_text.startswith("You are an embodied AI agent") for system_text in model.system_parts
    ] == [True]
    grown = join_parts(model.requests[1][0])
    assert grown == f"{prompt}{experts[4][0]}<|act|><image><|act|>"


def test_a_failed_first_plan_ends_it_too(run_scripted):
    (first, second), model, _ = run_scripted(["fly"])
    assert (first.ended, second.ended) == ("no action", "not attempted")
    assert len(model.requests) == 1


def test_with_a_memory_the_next_plan_follows_in_the_world_as_it_is(run_scripted):
    (first, second), model, _ = run_scripted(
        ["RotateLeft", "fly", *["RotateRight"] * 201], history="text"
    )
    assert (first.ended, second.ended) == ("no action", "step limit")
    assert len(second.steps) == 201
    prompts = [join_parts(parts) for parts, _ in model.requests]
    # The memory is not renewed.
    assert len({prompt.partition("Current state: ")[0] for prompt in prompts}) == 1
    for prompt in prompts:
        assert prompt.startswith("Your task is: put two slices of tomato")
        assert ".\nState: You are in the middle of a room. Your hands are free." in prompt
        assert prompt.endswith(";\nCurrent state: <image> Next action: ")
    assert model.requests[0][1].stop == ()
    digests = [parts[-2].digest for parts, _ in model.requests]
    assert digests[0] != digests[1]  # it has turned left,
    assert digests[1] == digests[2]  # and the next plan begins there
    assert any("Available actions: RotateLeft" in system_text for system_text in model.system_parts)


def test_the_state_in_the_file_is_taken_where_there_is_one(run_scripted, final):
    path = final / f"{FORK}.json"
    document = json.loads(path.read_text())
    first = document["sub_trajs"][-1]["low_pddl_idx"][0]
    path.write_text(json.dumps(document | {"state_summary": {str(first): "All is well"}}))
    _, model, _ = run_scripted(["fly", "fly"], history="text")
    assert "State: You are in the middle of a room. All is well;\n" in join_parts(
        model.requests[0][0]
    )


def test_frames_are_remembered_by_clip(run_scripted, make_clip):
    _, model, _ = run_scripted(["fly", "fly"], history="frames:3", retriever=str(make_clip()))
    prompt = join_parts(model.requests[0][0])
    assert prompt.startswith("Your task is: ")
    assert prompt.endswith(
        ".\nPrevious states: <image><image><image>Current state: <image> Next action: "
    )


def test_frames_that_the_file_names_are_remembered_in_the_published_size(run_scripted, final):
    path = final / f"{FORK}.json"
    document = json.loads(path.read_text())
    first = document["sub_trajs"][-1]["low_pddl_idx"][0]
    images = [{"low_idx": number, "image_name": f"{number + 1:09d}.png"} for number in range(first)]
    retrieved = {str(first): {"top20": ["000000000.png", "000000002.png", "000000005.png"]}}
    path.write_text(json.dumps(document | {"images": images, "retrieved_image": retrieved}))
    _, model, _ = run_scripted(["fly", "fly"], history="retrieved:20")
    parts = model.requests[0][0]
    assert join_parts(parts).endswith(
        ".\nPrevious states: <image><image><image>Current state: <image> Next action: "
    )
    assert [part.path.stem for part in parts if isinstance(part, FrameRef)][:3] == [
        "000000000-336",
        "000000002-336",
        "000000005-336",
    ]
    assert [
        system_text.count("previous states (history)") for system_text in model.system_parts
    ] == [1]


def test_a_file_that_names_no_frames_for_an_action_is_told_in_its_records(run_scripted, final):
    path = final / f"{FORK}.json"
    path.write_text(
        json.dumps(json.loads(path.read_text()) | {"retrieved_image": {"0": {"top20": []}}})
    )
    _, model, outcome = run_scripted([], history="retrieved:20")
    assert model.requests == []
    first, *others = outcome.records
    assert first.failure.startswith(f'trajectory {FORK}: retrieved_image["')
    assert first.failure.endswith(
        "(nothing was retrieved before this action); take --history frames:20"
    )
    assert {record.state for record in others} <= {"not asked"}


def test_files_that_name_no_frames_are_refused_before_the_work(run_scripted):
    with pytest.raises(DataError, match="infthor_final: no trajectory there has retrieved_image"):
        run_scripted([], history="retrieved:20")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"history": "last:100"},
            "--protocol published has the histories full, text, retrieved:K and frames:K, not "
            "last:100",
        ),
        (
            {"tasks": ("infthor_plans",)},
            "--protocol published is for final tasks; take --tasks infthor_final",
        ),
    ],
)
def test_what_the_scripts_have_not_is_refused(run_scripted, changes, expected):
    with pytest.raises(UsageError) as caught:
        run_scripted([], **changes)
    assert str(caught.value) == expected


def test_a_run_that_was_stopped_goes_on_to_the_same_end(prepare_run, final, experts, monkeypatch):
    rest = iter([*experts[4], "fly", *experts[4], "fly"])
    model = ScriptedModel(lambda *_: next(rest))
    monkeypatch.setattr("infthor_eval.runs.work.binding.load", lambda *_: model)
    settings = {
        "tasks": ("infthor_final",),
        "data": final,
        "protocol": "published",
        "history": "text",
    }
    whole = execute(prepare_run(QWEN, **settings))
    (journal,) = (whole.folder / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(lines[:-1]))
    again = execute(prepare_run(QWEN, **settings))
    assert [record.payload for record in again.records] == [
        record.payload for record in whole.records
    ]


def test_how_far_back_a_clue_is_stands_in_the_record_in_frames_and_tokens(
    run_scripted, experts, final
):
    (trajectory,) = iter_trajectories(final)
    plan = plans_of(trajectory, Words.PUBLISHED)[4]
    name = trajectory.plan.high_pddl[plan.high].discrete_action.args[0]
    seen, first = plan.low[0] - 7, plan.low[0]
    path = final / f"{FORK}.json"
    entries = [
        {"visible": [name.capitalize()] if number in (1, seen) else []}
        for number in range(first + 1)
    ]
    # Later than anybody may know.
    entries += [{"visible": [name]}] * (len(trajectory.plan.low_actions) - first)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"object_log": entries}))

    replies = [text for texts in experts[4:] for text in texts]
    plans, model, outcome = run_scripted(replies, protocol="default", rewards="default")
    # Two slices, both there.
    assert plans[0].ended == "done" and {plan.conditions[1] for plan in plans} == {4}
    # Tokens up to each frame: a word is one, a frame is one.
    n_tokens, after_goal, up_to = (0, False, [])
    for part in model.requests[0][0]:
        n_tokens += 1 if isinstance(part, FrameRef) else len(part.split())
        if isinstance(part, FrameRef) and (not up_to or not after_goal):
            up_to.append(n_tokens)
        after_goal = isinstance(part, str) and "<|goal|>" in part
    assert (plans[0].clue_distance, plans[0].clue_tokens) == (7, up_to[first] - up_to[seen])
    assert (plans[1].clue_distance, plans[1].clue_tokens) == (None, None)
    (task,) = outcome.summary.summary.tasks.values()
    assert {name: (rate.mean, rate.n) for name, rate in task.by_distance.items()} == {
        "0-49": (1.0, 1),
        "not seen": (float(plans[1].ended == "done"), 1),
    }
    assert task.by_tokens["0-1"].n == 1
    assert task.goal_conditions.mean == plans[-1].conditions[0] / 4
