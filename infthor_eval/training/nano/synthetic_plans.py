"""Synthetic plans: recorded plans with their actions, about other objects.

The words of a plan and the objects of its actions correspond, so a model learns which words name
which objects.
"""

import random
from collections import defaultdict
from collections.abc import Iterable, Sequence

from infthor_eval.plans.actors.habits import fill_action, open_action
from infthor_eval.plans.actors.script import read_plan, replace_objects

__all__ = ["SyntheticPlans"]


class SyntheticPlans:
    """Plans and actions of experts in which each object is replaced by one from the same place of a
    similar plan."""

    def __init__(self, recorded: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Group recorded plans by kind, without those whose actions name no object of the plan."""
        kinds: dict[tuple[str, tuple[str, ...]], list[str]] = defaultdict(list)
        for plan, actions in recorded:
            templates = tuple(open_action(action, plan) for action in actions)
            if templates != tuple(actions):
                kinds[read_plan(plan)[0], templates].append(plan)
        self._kinds = [(templates, plans) for (_, templates), plans in kinds.items()]

    def __bool__(self) -> bool:
        """Return True if any plan can be sampled."""
        return bool(self._kinds)

    def sample(self, rng: random.Random) -> tuple[str, list[str]]:
        """Return a plan and its actions; kinds are as frequent as in the recorded plans."""
        ((templates, plans),) = rng.choices(self._kinds, [len(plans) for _, plans in self._kinds])
        columns = zip(*(read_plan(plan)[1] for plan in plans), strict=True)
        plan = replace_objects(plans[0], [rng.choice(column) for column in columns])
        return plan, [fill_action(action, plan) for action in templates]
