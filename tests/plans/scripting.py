"""A model without weights that says what it is told to say."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.plan import plans_of, tasks_of
from model_adapters import Capabilities, Part, Reply, Transcript, check_turns

from ..helpers.prompts import join_parts

FIRST_GOAL = "<|goal|>Your main goal: put a fork in the drawer<|goal|>"  # of FORK, in a prompt
CAPABILITIES = Capabilities(token_ids=False, sampling=True, choices=True)


def count_tokens(parts: Iterable[Part]) -> int:
    """A word counts as a token, and so does a frame."""
    return sum(1 if isinstance(part, FrameRef) else len(part.split()) for part in parts)


class Talk(Transcript):
    """A conversation of it."""

    def __init__(self, model):
        super().__init__()
        self._model = model

    @property
    def parts(self) -> list[Part]:
        *system, turn = self.turns
        assert [other.role for other in system] in ([], ["system"])
        return list(turn.parts)

    @property
    def n_tokens(self):
        return count_tokens(self.parts)

    def reply(self, decoding):
        check_turns(self._model.name, self._model.capabilities, self.turns)
        for part in self.parts:
            if isinstance(part, FrameRef):
                assert part.digest  # it is there, and known when it no longer is
        self._model.requests.append((self.parts, decoding))
        self._model.system_parts = {part for turn in self.turns[:-1] for part in turn.parts}
        return Reply(self._model.say(self.parts, decoding), 1, self.n_tokens, 0)


class ScriptedModel:
    """Replies by a function of what was asked and the decoding; keeps what it was asked, and last
    told by a system."""

    name, capabilities = "qwen2.5-vl-tiny", CAPABILITIES

    def __init__(self, say: Callable[[Sequence[Part], object], str]):
        self.say = say
        self.requests: list[tuple[list[Part], object]] = []
        self.system_parts: set[Part] = set()

    def identity(self):
        return {}

    def tokens_per_frame(self, frame):
        return 1

    def conversation(self):
        return Talk(self)

    def close(self):
        pass


def plan_in_prompt(parts: Sequence[Part]) -> str:
    """The plan that is to be carried out."""
    return join_parts(parts).rpartition("<|plan|>Plan: ")[2].partition("<|plan|>")[0]


def goal_in_prompt(parts: Sequence[Part]) -> str:
    """The goal that it serves."""
    return join_parts(parts).rpartition("<|goal|>Your main goal: ")[2].partition("<|goal|>")[0]


def actions_in_prompt(parts: Sequence[Part]) -> list[str]:
    """The actions of that plan up to now."""
    return join_parts(parts).rpartition("<|plan|>")[2].split("<|act|>")[1:-1:2]


def beginnings(model: ScriptedModel) -> list[list[Part]]:
    """What was asked before each plan."""
    return [parts for parts, _ in model.requests if not actions_in_prompt(parts)]


def prompts(model: ScriptedModel) -> list[str]:
    """What was asked, as texts."""
    return [join_parts(parts) for parts, _ in model.requests]


def frames_in_prompt(parts: Sequence[Part]) -> list[FrameRef]:
    """What was seen."""
    return [part for part in parts if isinstance(part, FrameRef)]


def as_expert(folder: Path) -> Callable[[Sequence[Part], object], str]:
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
