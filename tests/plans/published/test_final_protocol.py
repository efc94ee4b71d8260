"""Final tasks in one go, as the published scripts run them."""

import json

import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.plan import plans_of

from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ..outcomes import payloads
from ..scripting import count_tokens, frames_in_prompt, prompts

pytestmark = pytest.mark.usefixtures("shared_simulators")

WITH_FRAMES = ".\nPrevious states: <image><image><image>Current state: <image> Next action: "
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
def change_file(final):
    """Changes what the trajectory's file says; `change` is given the final task's first action."""
    path = final / f"{FORK}.json"

    def change_file(change):
        document = json.loads(path.read_text())
        first = document["sub_trajs"][-1]["low_pddl_idx"][0]
        path.write_text(json.dumps(document | change(first)))

    return change_file


@pytest.fixture
def run_final(run_scripted, final):
    """Runs a model that says these texts one after the other; gives payloads, model and outcome."""

    def run_final(replies, **changes):
        rest = iter(replies)
        settings = {"tasks": ("infthor_final",), "data": final}
        settings |= {"protocol": "published", "rewards": "published"}
        outcome, model = run_scripted(lambda *_: next(rest), **settings | changes)
        return payloads(outcome), model, outcome

    return run_final


def test_the_interleaved_form_ends_after_its_first_plan(run_final, experts):
    (first, second), model, outcome = run_final(experts[4])
    assert (first.ended, second.ended) == ("done", "not attempted")
    (task,) = outcome.summary.summary.tasks.values()
    assert (task.n_plans, task.n_tried, task.success["total"].mean) == (2, 1, 0.5)
    parts, decoding = model.requests[0]
    prompt = prompts(model)[0]
    assert prompt.startswith(f"{FIRST}<|act|><|act|>")
    assert "<|plan|>" not in prompt
    assert prompt.count("<|goal|>Your main goal: ") == 2
    assert prompt.endswith("<|goal|><image><|act|>")
    frames = frames_in_prompt(parts)
    assert frames[0].digest == frames[-1].digest  # the scene's first frame stands behind each goal
    assert (decoding.max_new_tokens, decoding.temperature, decoding.stop) == (32, 0.0, ("<|act|>",))
    assert decoding.repetition_penalty is None
    (system_text,) = model.system_parts
    assert system_text.startswith("You are an embodied AI agent")
    assert prompts(model)[1] == f"{prompt}{experts[4][0]}<|act|><image><|act|>"


def test_a_failed_first_plan_ends_it_too(run_final):
    (first, second), model, _ = run_final(["fly"])
    assert (first.ended, second.ended) == ("no action", "not attempted")
    assert len(model.requests) == 1


def test_with_a_memory_the_next_plan_follows_in_the_world_as_it_is(run_final):
    (first, second), model, _ = run_final(
        ["RotateLeft", "fly", *["RotateRight"] * 201], history="text"
    )
    assert (first.ended, second.ended) == ("no action", "step limit")
    assert len(second.steps) == 201
    asked = prompts(model)
    # The memory is not renewed.
    assert len({prompt.partition("Current state: ")[0] for prompt in asked}) == 1
    for prompt in asked:
        assert prompt.startswith("Your task is: put two slices of tomato")
        assert ".\nState: You are in the middle of a room. Your hands are free." in prompt
        assert prompt.endswith(";\nCurrent state: <image> Next action: ")
    assert model.requests[0][1].stop == ()
    digests = [parts[-2].digest for parts, _ in model.requests]
    assert digests[0] != digests[1]  # it has turned left,
    assert digests[1] == digests[2]  # and the next plan begins there
    assert any("Available actions: RotateLeft" in text for text in model.system_parts)


def test_the_state_in_the_file_is_taken_where_there_is_one(run_final, change_file):
    change_file(lambda first: {"state_summary": {str(first): "All is well"}})
    _, model, _ = run_final(["fly", "fly"], history="text")
    assert "State: You are in the middle of a room. All is well;\n" in prompts(model)[0]


def test_frames_are_remembered_by_clip(run_final, make_clip):
    _, model, _ = run_final(["fly", "fly"], history="frames:3", retriever=str(make_clip()))
    assert prompts(model)[0].startswith("Your task is: ")
    assert prompts(model)[0].endswith(WITH_FRAMES)


def test_frames_that_the_file_names_are_remembered_in_the_published_size(run_final, change_file):
    def with_frames(first):
        images = [
            {"low_idx": number, "image_name": f"{number + 1:09d}.png"} for number in range(first)
        ]
        names = [f"{number:09d}.png" for number in (0, 2, 5)]
        return {"images": images, "retrieved_image": {str(first): {"top20": names}}}

    change_file(with_frames)
    _, model, _ = run_final(["fly", "fly"], history="retrieved:20")
    assert prompts(model)[0].endswith(WITH_FRAMES)
    shown = [frame.path.stem for frame in frames_in_prompt(model.requests[0][0])]
    assert shown[:3] == [f"{number:09d}-336" for number in (0, 2, 5)]
    assert [text.count("previous states (history)") for text in model.system_parts] == [1]


def test_a_file_that_names_no_frames_for_an_action_is_told_in_its_records(run_final, change_file):
    change_file(lambda _: {"retrieved_image": {"0": {"top20": []}}})
    _, model, outcome = run_final([], history="retrieved:20")
    assert model.requests == []
    first, *others = outcome.records
    assert first.failure.startswith(f'trajectory {FORK}: retrieved_image["')
    assert first.failure.endswith(
        "(nothing was retrieved before this action); take --history frames:20"
    )
    assert {record.state for record in others} <= {"not asked"}


def test_files_that_name_no_frames_are_refused_before_the_work(run_final):
    with pytest.raises(DataError, match="infthor_final: no trajectory there has retrieved_image"):
        run_final([], history="retrieved:20")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"history": "last:100"},
            "has the histories full, text, retrieved:K and frames:K, not last:100",
        ),
        ({"tasks": ("infthor_plans",)}, "is for final tasks; take --tasks infthor_final"),
    ],
)
def test_what_the_scripts_have_not_is_refused(run_final, changes, expected):
    with pytest.raises(UsageError) as caught:
        run_final([], **changes)
    assert str(caught.value) == f"--protocol published {expected}"


def test_a_run_that_was_stopped_goes_on_to_the_same_end(run_final, experts):
    replies = [*experts[4], "fly"]
    whole, _, outcome = run_final(replies, history="text")
    (journal,) = (outcome.folder / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(lines[:-1]))
    assert run_final(replies, history="text")[0] == whole


def test_how_far_back_a_clue_is_stands_in_the_record_in_frames_and_tokens(
    run_final, experts, final, change_file
):
    (trajectory,) = iter_trajectories(final)
    plan = plans_of(trajectory, Words.PUBLISHED)[4]
    name = trajectory.plan.high_pddl[plan.high].discrete_action.args[0]
    seen, first = plan.low[0] - 7, plan.low[0]
    entries = [
        {"visible": [name.capitalize()] if number in (1, seen) else []}
        for number in range(first + 1)
    ]
    # Later than anybody may know.
    entries += [{"visible": [name]}] * (len(trajectory.plan.low_actions) - first)
    change_file(lambda _: {"object_log": entries})

    replies = [text for texts in experts[4:] for text in texts]
    plans, model, outcome = run_final(replies, protocol="default", rewards="default")
    # Two slices, both there.
    assert plans[0].ended == "done" and {plan.conditions[1] for plan in plans} == {4}
    # Tokens up to each frame: a word is one, a frame is one.
    n_tokens, after_goal, up_to = (0, False, [])
    for part in model.requests[0][0]:
        n_tokens += count_tokens([part])
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
