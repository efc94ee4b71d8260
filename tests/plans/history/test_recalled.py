"""A memory in front of an agent: what it observes, and what the agent is given."""

from dataclasses import replace
from pathlib import Path

import pytest

from infthor_eval.errors import DataError, ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.plans.history.forms import FullHistory, history_named
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.history.recalled import MemoryChoice, RecalledHistory
from infthor_eval.plans.history.segments import PlanSegment
from model_adapters.own_file import load_from_file

from ...helpers.refusals import read_one_line

OWN = """
from infthor_eval.memory import MemoryCapabilities

SEEN = []


class Own:
    capabilities = MemoryCapabilities()

    def identity(self):
        return {}

    def begin(self, facts):
        SEEN.append("begin")
        self.past = []

    def observe(self, step):
        SEEN.append((step.number, step.frame.path.stem, step.action, step.goal))
        self.past.append(step)

    def recall(self, query, budget):
        SEEN.append((query.text, query.present.number, query.present.frame.path.stem))
        return ["before: ", *self.past[-2:]]
"""


def frame(name):
    return FrameRef(Path(f"{name}.png"))


def past(n_plans, episode="a"):
    """The history before a plan: every plan before has two steps, and every second one begins a
    task."""
    segments = []
    for plan in range(n_plans + 1):
        before = frame(f"{episode}{2 * plan}")
        steps = [(f"Act{2 * plan + step}", frame(f"{episode}{2 * plan + step}")) for step in (1, 2)]
        goal = f"goal {plan}" if plan % 2 == 0 else None
        segments.append(
            PlanSegment(f"plan {plan}", goal, before, tuple(steps) if plan < n_plans else ())
        )
    return Past(segments[:-1], segments[-1])


def names(parts):
    return [part if isinstance(part, str) else part.path.stem for part in parts]


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN)
    return f"{path}:Own"


def no_count(parts):
    raise AssertionError("nothing is counted without a budget")


def test_an_agent_is_given_what_is_recalled_then_goal_frame_and_plan(own):
    parts = RecalledHistory(own).recall(past(2), no_count)
    goal, plan = "<|goal|>Your main goal: goal 2<|goal|>", "<|plan|>Plan: plan 2<|plan|>"
    assert names(parts) == ["before: ", "a2", "a3", goal, "a4", plan]


def test_each_step_is_observed_once_and_another_episode_begins_anew(own):
    history = RecalledHistory(own)
    for situation in (past(0), past(1), past(2), past(1, "b")):
        history.recall(situation, no_count)
    seen = load_from_file(own).begin.__globals__["SEEN"]
    assert seen == [
        "begin",
        ("goal 0 plan 0", 0, "a0"),
        "begin",  # nothing was observed before
        (0, "a0", None, "goal 0"),
        (1, "a1", "Act1", "goal 0"),
        ("goal 0 plan 1", 2, "a2"),
        (2, "a2", "Act2", "goal 0"),
        (3, "a3", "Act3", "goal 0"),
        ("goal 2 plan 2", 4, "a4"),
        "begin",
        (0, "b0", None, "goal 0"),
        (1, "b1", "Act1", "goal 0"),
        ("goal 0 plan 1", 2, "b2"),
    ]


def test_a_budget_is_in_the_models_own_tokens(own):
    def count(parts):
        return 5 + 7 * len(parts)

    assert len(RecalledHistory("last", budget=20).choose(past(3), count)) == 2
    assert RecalledHistory("last", budget=6).choose(past(3), count) == []
    with pytest.raises(ModelError, match="counts no tokens, so --budget cannot be used"):
        RecalledHistory("last", budget=20).choose(past(3), lambda parts: None)
    with pytest.raises(ModelError, match="recalls 16 tokens where the budget is 10"):
        RecalledHistory(own, budget=10).choose(past(3), count)


def test_the_first_plan_has_nothing_to_recall():
    assert RecalledHistory("last").choose(past(0), no_count) == []
    assert past(0).frames == []


def test_an_agent_has_no_model_that_writes():
    expected = "the memory notes needs a model that writes for it, as agents do not"
    with pytest.raises(UsageError, match=expected):
        RecalledHistory("notes")


def test_privileged_memories_have_logs_and_the_last_sight_of_what_the_plan_needs():
    logs = [ObjectLog(visible=["Mug"] if number == 1 else ["Sofa"]) for number in range(7)]
    known = replace(past(3), logs=logs, clue=1)
    assert names(RecalledHistory("oracle", (("k", 1),)).choose(known, no_count)) == ["a1"]
    (text,) = RecalledHistory("text-log").choose(known, no_count)
    assert text.index("Sofa") < text.index("Mug") < text.rindex("Sofa")
    for name in ("oracle", "text-log"):
        expected = f"no log of what is in view, which the memory {name} needs"
        with pytest.raises(DataError, match=expected):
            RecalledHistory(name).choose(past(3), no_count)


LAST = {"name": "last"}


@pytest.mark.parametrize(
    ("history", "choice", "words"),
    [
        ("memory", {}, "--history memory: give --memory NAME"),
        (
            "full",
            {"name": "last"},
            "--memory last: --history full has no memory; use --history memory",
        ),
        ("text", {"budget": "4k"}, "--budget 4k: --history text has no memory"),
        ("memory", {"budget": "many"} | LAST, "--budget many: give a number of tokens from 1"),
        ("memory", {"retriever": "x"} | LAST, "the memory last retrieves no frames; leave it out"),
        ("memory", {"name": "lats"}, "unknown memory 'lats'; did you mean 'last'?"),
    ],
)
def test_options_that_do_not_fit_are_one_line(history, choice, words):
    with pytest.raises(UsageError) as caught:
        history_named(history, MemoryChoice(**choice))
    assert words in read_one_line(caught)


def test_identity_has_options_and_budget():
    identity = history_named("memory", MemoryChoice("last", "k=4", "1k")).identity()
    assert identity == {
        "memory": {"name": "last", "options": {"k": "4"}, "privileged": False},
        "budget": 1000,
    }
    assert isinstance(history_named("full", MemoryChoice()), FullHistory)


def test_a_memory_that_changes_its_logs_changes_nobody_elses_and_goes_on(tmp_path):
    path = tmp_path / "spoiler.py"
    observe = "        self.past.append(step)"
    spoil = '        step.log.visible.clear()\n        step.log.recep_objs["Sink"].append("Apple")'
    spoiler = OWN.replace("Capabilities()", "Capabilities(privileged=True)")
    path.write_text(spoiler.replace(observe, f"{spoil}\n{observe}"))
    logs = [ObjectLog(visible=["Mug"], recep_objs={"Sink": ["Mug"]}) for _ in range(5)]
    history = RecalledHistory(f"{path}:Own")
    for n_plans in (1, 2):
        history.recall(replace(past(n_plans), logs=logs), no_count)
    assert logs == [ObjectLog(visible=["Mug"], recep_objs={"Sink": ["Mug"]})] * 5
    assert history._memory.begin.__globals__["SEEN"].count("begin") == 1
