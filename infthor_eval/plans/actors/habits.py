"""What experts did next, by their plan's words and the last action: acting without a frame."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.sequence_text import action_text
from infthor_eval.plans.actors.script import read_plan
from infthor_eval.plans.plan import Plan, plans_of

_START = ""  # the action before the first one
_Key = tuple[str, ...]


class Habits:
    """The most frequent next action in the most similar known situation; of equals by name.

    A situation is the plan's text, the number of actions so far, and the last action. If it is
    unknown, less and less of it is compared (`_situations`). Actions are learned with placeholders
    for the plan's own objects.
    """

    def __init__(self, trajectories: Iterable[Trajectory], words: Words) -> None:
        """Count what experts did, in the words of the plans that it will be asked about."""
        self._seen: dict[_Key, Counter[str]] = defaultdict(Counter)
        for trajectory in trajectories:
            for plan in plans_of(trajectory, words):
                self._learn(plan.text, expert_texts(trajectory, plan, words))

    def next_action(self, plan: str, done: Sequence[str]) -> str:
        """Return the next action in a plan, after the actions done so far."""
        for key in _situations(plan, done):
            if key in self._seen:
                counts = self._seen[key]
                return fill_action(min(counts, key=lambda action: (-counts[action], action)), plan)
        return "NoOp"

    def _learn(self, plan: str, actions: Sequence[str]) -> None:
        for number, action in enumerate(actions):
            for key in _situations(plan, actions[:number]):
                self._seen[key][open_action(action, plan)] += 1


def expert_texts(trajectory: Trajectory, plan: Plan, words: Words) -> list[str]:
    """Return the expert's actions of a plan, in words."""
    return [
        action_text(trajectory.plan.low_actions[number].api_action, words)
        for number in range(*plan.low)
    ]


def _situations(plan: str, done: Sequence[str]) -> Iterator[_Key]:
    """Yield descriptions of a situation, the most specific first."""
    verb, _ = read_plan(plan)
    before = open_action(done[-1], plan) if done else _START
    number = str(len(done))
    yield "text", plan, number, before
    yield "text", plan, before
    yield "verb", verb, number, before
    yield "verb", verb, before
    yield "verb", verb


def open_action(action: str, plan: str) -> str:
    """Return an action with placeholders for the objects that its plan names."""
    _, types = read_plan(plan)
    return " ".join(
        f"{{{types.index(word)}}}" if word in types else word for word in action.split()
    )


def fill_action(action: str, plan: str) -> str:
    """Return an action with the objects of a plan in place of its placeholders."""
    _, types = read_plan(plan)
    for number, name in enumerate(types):
        action = action.replace(f"{{{number}}}", name)
    return action
