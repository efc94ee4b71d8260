"""Executing a symbolic plan in the simulator, sub-goal by sub-goal.

Receptacles are opened and closed where this is needed. The first action that the simulator refuses
ends the rollout.
"""

from collections.abc import Callable
from typing import Any, Protocol

from infthor_eval.formats.trajectory import ApiAction, PlannerAction
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.household.containment import direct_parent
from infthor_eval.household.symbolic import Operator
from infthor_eval.household.wording import compact_name
from infthor_eval.thor.view import SimulatorView


class Walking(Protocol):
    """Brings the agent to where it can act; see `walking.Walker`."""

    def go(self, object_ids: list[str], inside: str | None = None) -> None:
        """Walk to where objects can be acted on."""

    def step_aside(self, item: str, inside: str | None = None) -> None:
        """Walk to where an object can be acted on, within the current sub-goal."""

    def forget_grid(self) -> None:
        """Learn anew where the agent can stand."""


class Rollout:
    """Executes operators.

    Attributes:
        trace: actions and sub-goals so far.
    """

    def __init__(self, trace: Trace, walker: Walking) -> None:
        """Start with a trace without actions, to which the walker adds its own."""
        self.trace = trace
        self._walker = walker
        self._slices: dict[str, str] = {}  # real ids of planned slices

    def run(self, operators: list[Operator]) -> None:
        """Execute a plan.

        Raises:
            RolloutError: an action was refused, or there is no pose to act from.
        """
        for number, operator in enumerate(operators, 1):
            if operator.name == "GotoLocation" and number == len(operators):
                self._walker.go([operator.item])  # the plan ends at a lamp that is lit already
            elif operator.name != "GotoLocation":
                # Each sub-goal includes its walk: its object is known only then.
                _SUBGOALS[operator.name](self, operator)

    def put_down(self, item: str, receptacle: str) -> None:
        """Put down a held object in one sub-goal that includes its walk, as published.

        The sub-goal has the type of the receptacle, and that of the whole of a slice; the ids are
        in the action that puts it.

        Raises:
            RolloutError: as `run`.
        """
        held = item.partition("|")[0]
        place = self._view.objects[receptacle].object_type
        action = PlannerAction("PutObject", object_id=held, receptacle_id=place)
        self.trace.begin([held, place], action)
        outer = self._closed_around(receptacle)
        self._walker.step_aside(outer or receptacle, receptacle if outer else None)
        self._put_from_here(item, receptacle, outer)

    def fetch(self, item: str) -> None:
        """Pick up an object in one sub-goal that includes its walk: no sub-goal names its place.

        What it is in is opened if it is closed, and stays open.

        Raises:
            RolloutError: as `run`.
        """
        self._begin("PickupObject", item)
        holder = self._closed_around(item)
        self._walker.step_aside(holder or item, item if holder else None)
        if holder is not None:
            self._interact("OpenObject", holder)
        self._interact("PickupObject", item)

    def bring(self, item: str, receptacle: str) -> None:
        """Put a held object into an open receptacle in one sub-goal that includes its walk.

        Raises:
            RolloutError: as `run`.
        """
        self._begin("PutObject", item, receptacle)
        self._walker.step_aside(receptacle)
        self._interact("PutObject", item, receptacle)

    def put_here(self, item: str, receptacle: str) -> None:
        """Put a held object into an open receptacle in one sub-goal, from where the agent stands.

        Raises:
            RolloutError: as `run`.
        """
        self._begin("PutObject", item, receptacle)
        self._interact("PutObject", item, receptacle)

    # -- sub-goals

    def _pickup_or_slice(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        holder = self._closed_around(item)
        self._walker.go([holder] if holder else [item], inside=item if holder else None)
        self._begin(operator.name, item)
        self._inside(holder, lambda: self._interact(operator.name, item))

    def _put(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        receptacle = self._resolve(operator.receptacle or "")
        outer = self._closed_around(receptacle)  # as a drawer with the pan
        self._walker.go([outer or receptacle], inside=receptacle if outer else None)
        self._begin("PutObject", item, receptacle)
        self._put_from_here(item, receptacle, outer)

    def _toggle(self, operator: Operator) -> None:
        self._walker.go([operator.item])
        self._begin("ToggleObject", operator.item)
        self._interact("ToggleObjectOn", operator.item)

    def _clean(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        basin = operator.receptacle or ""
        faucet = self._nearest("Faucet", basin)
        self._walker.go([basin, faucet])
        self._begin("CleanObject", item, basin)
        self._interact("PutObject", item, basin)
        self._interact("ToggleObjectOn", faucet)
        self._interact("ToggleObjectOff", faucet)
        self._interact("PickupObject", item)

    def _heat_or_cool(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        appliance = operator.receptacle or ""
        self._walker.go([appliance])
        self._begin(operator.name, item, appliance)
        self._inside(appliance, lambda: self._interact("PutObject", item, appliance))
        if operator.name == "HeatObject":
            self._interact("ToggleObjectOn", appliance)
            self._interact("ToggleObjectOff", appliance)
        self._inside(appliance, lambda: self._interact("PickupObject", item))

    # -- parts of sub-goals

    def _begin(self, name: str, item: str, receptacle: str | None = None) -> None:
        ids = [key for key in (item, receptacle) if key is not None]
        words = [compact_name(self._view.objects[key].object_type) for key in ids]
        self.trace.begin(words, PlannerAction(name, object_id=item, receptacle_id=receptacle))

    def _put_from_here(self, item: str, receptacle: str, outer: str | None) -> None:
        """Put an object into a receptacle, which may be closed or in another that is."""
        holder = receptacle if self._is_closed(receptacle) else outer
        self._inside(holder, lambda: self._interact("PutObject", item, receptacle))

    def _inside(self, holder: str | None, act: Callable[[], None]) -> None:
        """Open a receptacle, act, and close it; without a receptacle, only act."""
        if holder is not None:
            self._interact("OpenObject", holder)
        act()
        if holder is not None:
            self._interact("CloseObject", holder)

    def _interact(self, action: str, item: str, receptacle: str | None = None) -> None:
        """Execute an action on an object; a stored PutObject has the held object and receptacle."""
        acted_on = item if receptacle is None else receptacle
        if acted_on not in self._view.objects:
            raise RolloutError(f"{action}: {acted_on.split('|')[0]} is gone")
        if not self._view.objects[acted_on].visible:
            # An object that was just put down or uncovered may not be visible from here.
            self._walker.step_aside(acted_on)
        call: dict[str, Any] = {"objectId": acted_on}
        api = ApiAction(action, object_id=item)
        if receptacle is not None:
            # A recorded floor plan takes a forced put even where nothing is free; an unforced one
            # goes to the same places but these, so that what is stored is done again alike.
            unseen = not self._view.objects[acted_on].visible
            call |= {"forceAction": unseen, "placeStationary": True}
            api = ApiAction(
                action, object_id=item, receptacle_id=receptacle,
                force_action=True, place_stationary=True,  # as the published generator puts
            )  # fmt: skip
        self.trace.act(api, call)
        # a door or an object on the floor may block cells now, or no longer
        self._walker.forget_grid()

    # -- objects

    @property
    def _view(self) -> SimulatorView:
        return self.trace.view

    def _resolve(self, item: str) -> str:
        """Return the object id of a planned item; a planned slice gets a real one when needed."""
        if "#" not in item:
            return item
        if item not in self._slices:
            whole = item.partition("#")[0]
            object_type = f"{whole.partition('|')[0]}Sliced"
            taken = set(self._slices.values())
            free = [
                key
                for key, candidate in self._view.objects.items()
                if candidate.object_type == object_type
                and key.startswith(whole)
                and key not in taken
            ]
            if not free:
                raise RolloutError(f"slicing left no {object_type}")
            visible = [key for key in free if self._view.objects[key].visible]
            self._slices[item] = min(visible or free)
        return self._slices[item]

    def _closed_around(self, item: str) -> str | None:
        """Return the closed receptacle that an object is in, or None."""
        objects = self._view.objects
        current = objects[item]
        while (parent := direct_parent(current, objects)) is not None:
            if self._is_closed(parent):
                return parent
            current = objects[parent]
        return None

    def _is_closed(self, key: str) -> bool:
        item = self._view.objects[key]
        return bool(item.openable and not item.is_open and item.receptacle)

    def _nearest(self, object_type: str, to: str) -> str:
        objects = self._view.objects
        candidates = [item for item in objects.values() if item.object_type == object_type]
        if not candidates:
            raise RolloutError(f"no {object_type} in the room")
        at = objects[to].position
        return min(
            candidates,
            key=lambda item: (item.position.x - at.x) ** 2 + (item.position.z - at.z) ** 2,
        ).object_id


_SUBGOALS: dict[str, Callable[[Rollout, Operator], None]] = {
    "PickupObject": Rollout._pickup_or_slice,
    "PutObject": Rollout._put,
    "SliceObject": Rollout._pickup_or_slice,
    "ToggleObject": Rollout._toggle,
    "CleanObject": Rollout._clean,
    "HeatObject": Rollout._heat_or_cool,
    "CoolObject": Rollout._heat_or_cool,
}
