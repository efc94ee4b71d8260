"""Carrying a symbolic plan out in the simulator, sub-goal by sub-goal.

Doors are opened and closed around what needs it. Every action goes through the simulator, and the first one that it
refuses ends the rollout.
"""

from collections.abc import Callable

from infthor_eval.formats.trajectory import ApiAction, PlannerAction
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.generation.walking import Walker
from infthor_eval.household.containment import direct_parent
from infthor_eval.household.symbolic import Operator
from infthor_eval.household.wording import compact_name
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

__all__ = ["Rollout"]


class Rollout:
    """Operators turned into actions. `trace` has what was done so far."""

    def __init__(self, simulator: Simulator, first_high: int = 0) -> None:
        """Begin with nothing done.

        Args:
            simulator: carries the actions out.
            first_high: number of the first sub-goal.
        """
        self.trace = Trace(simulator, first_high)
        self._walker = Walker(self.trace)
        self._slices: dict[str, str] = {}

    def run(self, operators: list[Operator]) -> None:
        """Carry out a plan.

        Raises:
            RolloutError: an action was refused, or there is no place to act from.
        """
        for number, operator in enumerate(operators, 1):
            if operator.name == "GotoLocation" and number == len(operators):
                self._walker.go([operator.item])  # to a lamp that is lit already
            elif operator.name != "GotoLocation":  # walked to when it is known what for
                _SUBGOALS[operator.name](self, operator)

    # -- sub-goals

    def _pickup(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        holder = self._closed_around(item)
        self._walker.go([holder] if holder else [item], inside=item if holder else None)
        self._begin("PickupObject", item)
        self._inside(holder, lambda: self._interact("PickupObject", item))

    def _put(self, operator: Operator) -> None:
        item, receptacle = self._resolve(operator.item), self._resolve(operator.receptacle or "")
        self._walker.go([receptacle])
        self._begin("PutObject", item, receptacle)
        holder = receptacle if self._is_closed(receptacle) else None
        self._inside(holder, lambda: self._interact("PutObject", item, receptacle))

    def _slice(self, operator: Operator) -> None:
        holder = self._closed_around(operator.item)
        self._walker.go([holder] if holder else [operator.item], inside=operator.item if holder else None)
        self._begin("SliceObject", operator.item)
        self._inside(holder, lambda: self._interact("SliceObject", operator.item))

    def _toggle(self, operator: Operator) -> None:
        self._walker.go([operator.item])
        self._begin("ToggleObject", operator.item)
        self._interact("ToggleObjectOn", operator.item)

    def _clean(self, operator: Operator) -> None:
        item, basin = self._resolve(operator.item), operator.receptacle or ""
        faucet = self._nearest("Faucet", basin)
        self._walker.go([basin, faucet])
        self._begin("CleanObject", item, basin)
        self._interact("PutObject", item, basin)
        self._interact("ToggleObjectOn", faucet)
        self._interact("ToggleObjectOff", faucet)
        self._interact("PickupObject", item)

    def _heat(self, operator: Operator) -> None:
        item, oven = self._resolve(operator.item), operator.receptacle or ""
        self._walker.go([oven])
        self._begin("HeatObject", item, oven)
        self._inside(oven, lambda: self._interact("PutObject", item, oven))
        self._interact("ToggleObjectOn", oven)
        self._interact("ToggleObjectOff", oven)
        self._inside(oven, lambda: self._interact("PickupObject", item))

    def _cool(self, operator: Operator) -> None:
        item, fridge = self._resolve(operator.item), operator.receptacle or ""
        self._walker.go([fridge])
        self._begin("CoolObject", item, fridge)
        self._inside(fridge, lambda: self._interact("PutObject", item, fridge))
        self._inside(fridge, lambda: self._interact("PickupObject", item))

    # -- their parts

    def _begin(self, name: str, item: str, receptacle: str | None = None) -> None:
        ids = [key for key in (item, receptacle) if key is not None]
        words = [compact_name(self._view.objects[key].object_type) for key in ids]
        self.trace.begin(words, PlannerAction(name, object_id=item, receptacle_id=receptacle))

    def _inside(self, holder: str | None, act: Callable[[], None]) -> None:
        """Open what holds the object, act, and close it again; just act where nothing is closed."""
        if holder is not None:
            self._interact("OpenObject", holder)
        act()
        if holder is not None:
            self._interact("CloseObject", holder)

    def _interact(self, action: str, item: str, receptacle: str | None = None) -> None:
        """An action on an object, stored in the form that trajectories have (the held object and its
        receptacle)."""
        acted_on = item if receptacle is None else receptacle
        if acted_on not in self._view.objects:
            raise RolloutError(f"{action}: {acted_on.split('|')[0]} is gone")
        if not self._view.objects[acted_on].visible:
            # A thing just put down or uncovered may lie where it cannot be seen from here.
            self._walker.step_aside(acted_on)
        self.trace.act(ApiAction(action, object_id=item, receptacle_id=receptacle), {"objectId": acted_on})
        self._walker.forget_grid()  # a door or a thing on the floor may be in the way now, or no longer

    # -- what is where

    @property
    def _view(self) -> SimulatorView:
        return self.trace.view

    def _resolve(self, item: str) -> str:
        """The object that a planned item is; a planned slice becomes a real one when it is first needed."""
        if "#" not in item:
            return item
        if item not in self._slices:
            whole = item.partition("#")[0]
            object_type = f"{whole.partition('|')[0]}Sliced"
            taken = set(self._slices.values())
            free = [
                key
                for key, found in self._view.objects.items()
                if found.object_type == object_type and key.startswith(whole) and key not in taken
            ]
            if not free:
                raise RolloutError(f"no {object_type} came of slicing")
            self._slices[item] = min(free, key=lambda key: (not self._view.objects[key].visible, key))
        return self._slices[item]

    def _closed_around(self, item: str) -> str | None:
        """The closed receptacle that hides an object, if one does."""
        objects = self._view.objects
        current = objects[item]
        while (parent := direct_parent(current, objects)) is not None:
            if self._is_closed(parent):
                return parent
            current = objects[parent]
        return None

    def _is_closed(self, key: str) -> bool:
        item = self._view.objects[key]
        return item.openable and not item.is_open and item.receptacle

    def _nearest(self, object_type: str, to: str) -> str:
        objects = self._view.objects
        found = [item for item in objects.values() if item.object_type == object_type]
        if not found:
            raise RolloutError(f"no {object_type} in the room")
        at = objects[to].position
        return min(found, key=lambda item: (item.position.x - at.x) ** 2 + (item.position.z - at.z) ** 2).object_id


_SUBGOALS: dict[str, Callable[[Rollout, Operator], None]] = {
    "PickupObject": Rollout._pickup,
    "PutObject": Rollout._put,
    "SliceObject": Rollout._slice,
    "ToggleObject": Rollout._toggle,
    "CleanObject": Rollout._clean,
    "HeatObject": Rollout._heat,
    "CoolObject": Rollout._cool,
}
