"""What a rollout did: every action goes through the simulator and is kept in the form that trajectories have."""

from dataclasses import dataclass
from typing import Any

from infthor_eval.formats.trajectory import ApiAction, DiscreteAction, HighAction, LowAction, PlannerAction
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

__all__ = ["ExecutedAction", "RolloutError", "Trace"]


class RolloutError(Exception):
    """The plan cannot be carried out here; the message says at which action and why.

    Attributes:
        item: id of an object that cannot be acted on as things are, where it was that.
        receptacle: id of the receptacle that the object finds no room in, where it was that.
    """

    def __init__(self, message: str, item: str | None = None, receptacle: str | None = None) -> None:
        super().__init__(message)
        self.item = item
        self.receptacle = receptacle


@dataclass(frozen=True)
class ExecutedAction:
    """One action that was carried out: as it is stored, and the world after it."""

    low: LowAction
    view: SimulatorView


class Trace:
    """The actions and sub-goals so far.

    Attributes:
        simulator: carries the actions out.
        actions: executed actions.
        high: the sub-goals.
    """

    def __init__(self, simulator: Simulator, first_high: int = 0) -> None:
        """Begin with nothing done.

        Args:
            simulator: carries the actions out.
            first_high: number of the first sub-goal.
        """
        self.simulator = simulator
        self.actions: list[ExecutedAction] = []
        self.high: list[HighAction] = []
        self._first_high = first_high

    @property
    def view(self) -> SimulatorView:
        """The world after the last action."""
        return self.simulator.view

    def begin(self, words: list[str], action: PlannerAction) -> None:
        """Begin a sub-goal: the actions from here on belong to it.

        Args:
            words: the object types that it is about, in words.
            action: what it is.
        """
        number = self._first_high + len(self.high)
        self.high.append(HighAction(number, DiscreteAction(action.action, words), action))

    def act(self, api: ApiAction, arguments: dict[str, Any], suffix: str = "") -> None:
        """Carry out one action of the present sub-goal.

        Args:
            api: the action as it is stored.
            arguments: of the call.
            suffix: of its name in words ("MoveAhead_25").

        Raises:
            RolloutError: the simulator refused it; nothing is kept of it.
        """
        before = self.view
        after = self.simulator.step(api.action, **arguments)
        if not after.success:
            raise RolloutError(f"{api.action}: {after.error}", api.object_id, api.receptacle_id)
        name = f"{api.action}_{suffix}" if suffix else api.action
        number = self._first_high + len(self.high) - 1
        self.actions.append(
            ExecutedAction(LowAction(api, number, DiscreteAction(name, _box(before, arguments))), after)
        )


def _box(view: SimulatorView, arguments: dict[str, Any]) -> dict[str, Any]:
    """The box of the object acted on, as trajectories store it with the action."""
    shown = (view.instances or {}).get(arguments.get("objectId", ""))
    return {} if shown is None else {"bbox": list(shown.box)}
