"""Trying a plan before walking: interactions are forced from where the agent is, and taken back.

So what is full, and what is not allowed where, is known before the first step. It costs a fifth of
what the walks do.
"""

from typing import Any

from infthor_eval.formats.trajectory import ApiAction
from infthor_eval.generation.rollout import Rollout
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.household.goals import goal_holds
from infthor_eval.household.symbolic import Operator
from infthor_eval.household.tasks import Task
from infthor_eval.thor.simulator import Simulator

_NO_PICTURES = {"renderImage": False, "renderInstanceSegmentation": False}


class _Stage:
    """Stands in for a walker: everything is in reach."""

    def go(self, object_ids: list[str], inside: str | None = None) -> None:
        """Do nothing."""

    def step_aside(self, item: str, inside: str | None = None) -> None:
        """Do nothing."""

    def forget_grid(self) -> None:
        """Do nothing."""


class _ForcedTrace(Trace):
    """Executes actions wherever their objects are, without pictures."""

    def act(self, api: ApiAction, arguments: dict[str, Any], suffix: str = "") -> None:
        """Execute one action; raises as that of a trace does."""
        super().act(api, {**arguments, **_NO_PICTURES, "forceAction": True}, suffix)


def rehearse(task: Task, operators: list[Operator], simulator: Simulator) -> RolloutError | None:
    """Return why a plan fails wherever the agent stands; None if it may work.

    The simulator is left as it was. One that cannot store its state is not asked, as going back
    would take as long as the trajectory.
    """
    mark = simulator.mark()
    if not simulator.stores(mark):
        return None
    try:
        Rollout(_ForcedTrace(simulator), _Stage()).run(operators)
        works = task.light is not None or goal_holds(task, simulator.view)
        if works:
            return None
        return RolloutError(f"{task.task_type}: its plan would not reach its goal")
    except RolloutError as error:
        return error
    finally:
        simulator.rewind(mark, exactly=True)
