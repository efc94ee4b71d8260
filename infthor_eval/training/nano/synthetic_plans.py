"""Plans that are made up, with the actions that carry them out: what the words of a plan name, its actions name too."""

import random
from collections import defaultdict
from collections.abc import Iterable, Sequence

from infthor_eval.plans.habits import fill_action, open_action
from infthor_eval.plans.script import read_plan, replace_objects

__all__ = ["SyntheticPlans"]


class SyntheticPlans:
    """What experts did, about other objects: each stood in the same place of a plan that was carried out alike."""

    def __init__(self, carried_out: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Learn the kinds of plans; those whose actions name no object of theirs, as ways do, are left aside.

        Args:
            carried_out: texts of plans, each with its actions.
        """
        kinds: dict[tuple[str, tuple[str, ...]], list[str]] = defaultdict(list)
        for plan, actions in carried_out:
            opened = tuple(open_action(action, plan) for action in actions)
            if opened != tuple(actions):
                kinds[read_plan(plan)[0], opened].append(plan)
        self._kinds = [(opened, plans) for (_, opened), plans in kinds.items()]

    def __bool__(self) -> bool:
        """Whether any is known."""
        return bool(self._kinds)

    def drawn(self, draw: random.Random) -> tuple[str, list[str]]:
        """A plan and its actions, kinds as often as experts had them."""
        ((opened, plans),) = draw.choices(self._kinds, [len(plans) for _, plans in self._kinds])
        columns = zip(*(read_plan(plan)[1] for plan in plans), strict=True)
        plan = replace_objects(plans[0], [draw.choice(column) for column in columns])
        return plan, [fill_action(action, plan) for action in opened]
