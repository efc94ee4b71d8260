"""The actions of a rollout, executed in the simulator and stored in the form of trajectories."""

from dataclasses import dataclass
from typing import Any

from infthor_eval.formats.trajectory import (
    ApiAction,
    DiscreteAction,
    HighAction,
    LowAction,
    PlannerAction,
)
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView


class RolloutError(Exception):
    """A plan failed in the simulator; the message has the action and the reason.

    Attributes:
        item: id of the object that could not be acted on, if that is the reason.
        receptacle: id of the receptacle without room for the object, if that is the reason.
    """

    def __init__(
        self, message: str, item: str | None = None, receptacle: str | None = None
    ) -> None:
        super().__init__(message)
        self.item = item
        self.receptacle = receptacle


@dataclass(frozen=True)
class ExecutedAction:
    """One executed action in its stored form, with the state after it and the call's arguments."""

    low: LowAction
    view: SimulatorView
    arguments: dict[str, Any]


class Trace:
    """The actions and sub-goals so far.

    Attributes:
        simulator: simulator that executes the actions.
        actions: executed actions.
        high: sub-goals.
    """

    def __init__(self, simulator: Simulator, first_high: int = 0) -> None:
        """Start without actions, at the sub-goal with the number `first_high`."""
        self.simulator = simulator
        self.actions: list[ExecutedAction] = []
        self.high: list[HighAction] = []
        self._first_high = first_high

    @property
    def view(self) -> SimulatorView:
        """State after the last action."""
        return self.simulator.view

    def begin(self, words: list[str], action: PlannerAction) -> None:
        """Begin a sub-goal with its object types in words; the following actions belong to it."""
        number = self._first_high + len(self.high)
        self.high.append(HighAction(number, DiscreteAction(action.action, words), action))

    def act(self, api: ApiAction, arguments: dict[str, Any], suffix: str = "") -> None:
        """Execute one action of the current sub-goal.

        Args:
            api: the action in its stored form.
            arguments: arguments of the call.
            suffix: suffix of its name in words (25 for "MoveAhead_25").

        Raises:
            RolloutError: the simulator refused the action, which is not stored.
        """
        before = self.view
        after = self.simulator.step(api.action, **arguments)
        if not after.success:
            raise RolloutError(f"{api.action}: {after.error}", api.object_id, api.receptacle_id)
        name = f"{api.action}_{suffix}" if suffix else api.action
        number = self._first_high + len(self.high) - 1
        low = LowAction(api, number, DiscreteAction(name, _box(before, arguments)))
        self.actions.append(ExecutedAction(low, after, arguments))


def _box(view: SimulatorView, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the box of the object acted on, in the form of trajectories."""
    instance = (view.instances or {}).get(arguments.get("objectId", ""))
    return {} if instance is None else {"bbox": list(instance.box)}
