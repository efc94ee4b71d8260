"""Plans as the published chat scripts ask for them, against what their functions gave."""

import json
from pathlib import Path

import pytest

from infthor_eval.formats.frames import FrameRef
from infthor_eval.plans.history.forms import history_named
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.history.recalled import MemoryChoice
from infthor_eval.plans.history.segments import PlanSegment
from infthor_eval.plans.published.final_protocol import chat_form, present_parts

from ...helpers.prompts import join_parts
from ..outcomes import endings
from ..scripting import prompts

GOLDEN = json.loads((Path(__file__).parents[2] / "goldens" / "chat_prompts.json").read_text())
OF_PLANS = [item for item in GOLDEN if "plans" in item]


def frame(name):
    return FrameRef(Path(f"{name}.png"))


def frames_of(parts):
    return [part.path.stem for part in parts if isinstance(part, FrameRef)]


def form_named(name):
    return chat_form(history_named(name, MemoryChoice()))


@pytest.mark.parametrize("item", OF_PLANS, ids=lambda item: str(len(item["plans"])))
def test_the_plans_before_are_told_as_published(item):
    *before, present = [
        PlanSegment(plan, None, frame("first"), (("Act", frame("mid")),)) for plan in item["plans"]
    ]
    outside = PlanSegment(
        "put what is held away", None, frame("first"), (("Act", frame("mid")),), in_task=False
    )
    form = form_named("plans")
    past = Past([*before, outside], present)
    parts = [*form.history.recall(past, lambda _: None), *present_parts(frame("last"))]
    assert [["system", form.system], ["user", join_parts(parts)]] == item["messages"]
    assert frames_of(parts) == item["frames"][-1:]


def test_goals_and_actions_are_told_as_published():
    (item,) = [item for item in GOLDEN if item["script"] == "run_interactive_eval_qwen.py"]
    go = [(action, frame(action)) for action in ("MoveAhead", "RotateLeft")]
    pick = [(action, frame(action)) for action in ("PickupObject Fork",)]
    goal, next_goal = "put a fork in the drawer", "put a mug in the sink"
    segments = [
        PlanSegment("go", goal, frame("scene"), tuple(go)),
        PlanSegment("pick", None, frame("x"), tuple(pick)),
    ]
    form = form_named("goals")
    recalled = form.history.recall(
        Past(segments, PlanSegment("go", next_goal, frame("y"))), lambda _: None
    )
    parts = [*recalled, "<|act|>"]  # where an agent that is not asked anew goes on
    assert [["system", form.system], ["user", join_parts(parts)]] == item["messages"]
    assert frames_of(parts) == item["frames"]


def test_other_histories_are_no_chat():
    assert form_named("full") is None


@pytest.mark.usefixtures("shared_simulators")
def test_every_plan_is_asked_from_the_true_state(run_scripted):
    outcome, model = run_scripted(lambda *_: "fly", history="plans")
    assert endings(outcome) == ["no action"] * 4
    plans = [record.payload.plan for record in outcome.records]
    expected = ["No history is available.", *("; ".join(plans[:n]) + ";" for n in (1, 2, 3))]
    assert prompts(model) == [
        f"Action history: {history}\nCurrent state: <image> Next action: " for history in expected
    ]
    assert all((it.max_new_tokens, it.stop) == (32, ()) for _, it in model.requests)
    _, model = run_scripted(lambda *_: "fly", history="goals")
    assert prompts(model)[-1].endswith("<image><|act|>")
    assert "<|plan|>" not in prompts(model)[-1]
    decoding = model.requests[-1][1]
    assert (decoding.max_new_tokens, decoding.stop) == (32, ("<|act|>",))
