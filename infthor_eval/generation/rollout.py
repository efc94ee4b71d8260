"""Carrying a symbolic plan out in the simulator, action by action.

Walking is planned on the grid as it comes; doors are opened and closed around what needs it. Every action
goes through the simulator, and the first one that it refuses ends the rollout.
"""

from dataclasses import dataclass, field
from typing import Any

from infthor_eval.formats.trajectory import ApiAction, DiscreteAction, HighAction, LowAction, PlannerAction
from infthor_eval.household.containment import direct_parent
from infthor_eval.household.navigation import GRID, Grid
from infthor_eval.household.scout import HORIZON_STEP, Viewpoint, find_viewpoint, reachable, stand_of
from infthor_eval.household.symbolic import Operator
from infthor_eval.household.wording import compact
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import View

__all__ = ["Acted", "Rollout", "RolloutError"]

_TURN = 90
_MIN_PIXELS = 60  # of what is acted on, in a frame of 90,000


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
class Acted:
    """One action that was carried out: as it is stored, and the world after it."""

    low: LowAction
    view: View
    target: str | None
    receptacle: str | None


@dataclass
class Rollout:
    """The actions and sub-goals so far.

    Attributes:
        simulator: carries the actions out.
        acted: the actions.
        high: the sub-goals.
        first_high: number of the first sub-goal.
    """

    simulator: Simulator
    first_high: int = 0
    acted: list[Acted] = field(default_factory=list)
    high: list[HighAction] = field(default_factory=list)
    _slices: dict[str, str] = field(default_factory=dict)
    _grid: Grid | None = None

    def run(self, operators: list[Operator]) -> None:
        """Carry out a plan.

        Raises:
            RolloutError: an action was refused, or there is no place to act from.
        """
        for operator in operators:
            if operator.name == "GotoLocation":
                continue  # walked to when it is known what for
            getattr(self, f"_{operator.name.removesuffix('Object').lower()}")(operator)

    # -- sub-goals

    def _pickup(self, operator: Operator) -> None:
        item = self._resolve(operator.item)
        holder = self._closed_around(item)
        self._go([holder] if holder else [item], inside=item if holder else None)
        self._begin("PickupObject", item)
        self._inside(holder, lambda: self._interact("PickupObject", item))

    def _put(self, operator: Operator) -> None:
        item, receptacle = self._resolve(operator.item), self._resolve(operator.receptacle or "")
        self._go([receptacle])
        self._begin("PutObject", item, receptacle)
        holder = receptacle if self._is_closed(receptacle) else None
        self._inside(holder, lambda: self._interact("PutObject", item, receptacle))

    def _slice(self, operator: Operator) -> None:
        holder = self._closed_around(operator.item)
        self._go([holder] if holder else [operator.item], inside=operator.item if holder else None)
        self._begin("SliceObject", operator.item)
        self._inside(holder, lambda: self._interact("SliceObject", operator.item))

    def _toggle(self, operator: Operator) -> None:
        self._go([operator.item])
        self._begin("ToggleObject", operator.item)
        self._interact("ToggleObjectOn", operator.item)

    def _clean(self, operator: Operator) -> None:
        item, basin = self._resolve(operator.item), operator.receptacle or ""
        faucet = self._nearest("Faucet", basin)
        self._go([basin, faucet])
        self._begin("CleanObject", item, basin)
        self._interact("PutObject", item, basin)
        self._interact("ToggleObjectOn", faucet)
        self._interact("ToggleObjectOff", faucet)
        self._interact("PickupObject", item)

    def _heat(self, operator: Operator) -> None:
        item, oven = self._resolve(operator.item), operator.receptacle or ""
        self._go([oven])
        self._begin("HeatObject", item, oven)
        self._inside(oven, lambda: self._interact("PutObject", item, oven))
        self._interact("ToggleObjectOn", oven)
        self._interact("ToggleObjectOff", oven)
        self._inside(oven, lambda: self._interact("PickupObject", item))

    def _cool(self, operator: Operator) -> None:
        item, fridge = self._resolve(operator.item), operator.receptacle or ""
        self._go([fridge])
        self._begin("CoolObject", item, fridge)
        self._inside(fridge, lambda: self._interact("PutObject", item, fridge))
        self._inside(fridge, lambda: self._interact("PickupObject", item))

    def _begin(self, name: str, item: str, receptacle: str | None = None) -> None:
        ids = [key for key in (item, receptacle) if key is not None]
        words = [compact(self._view.objects[key].object_type) for key in ids]
        action = PlannerAction(name, object_id=item, receptacle_id=receptacle)
        self.high.append(HighAction(self.first_high + len(self.high), DiscreteAction(name, words), action))

    def _inside(self, holder: str | None, act: Any) -> None:
        """Open what holds the object, act, and close it again; just act where nothing is closed."""
        if holder is not None:
            self._interact("OpenObject", holder)
        act()
        if holder is not None:
            self._interact("CloseObject", holder)

    # -- walking

    def _go(self, shown: list[str], inside: str | None = None) -> None:
        """Walk to where the objects can be acted on, as a sub-goal of its own."""
        target = self._view.objects[shown[0]]
        viewpoint = self._viewpoint(shown, inside)
        if self._moves(viewpoint) == []:
            return
        (x, z), facing = viewpoint.stand.cell, viewpoint.stand.facing
        location = f"loc|{x}|{z}|{facing // _TURN}|{viewpoint.horizon}"
        action = PlannerAction("GotoLocation", location=location, object_id=target.object_id)
        words = DiscreteAction("GotoLocation", [compact(target.object_type)])
        self.high.append(HighAction(self.first_high + len(self.high), words, action))
        self._walk(viewpoint, shown)

    def _viewpoint(self, shown: list[str], inside: str | None = None) -> Viewpoint:
        """Where to act on the objects from."""
        found = find_viewpoint(self.simulator, self._cells(), shown, inside, _MIN_PIXELS)
        if found is None:
            target = self._view.objects[inside or shown[0]]
            raise RolloutError(f"no place to reach {target.object_type} from", target.object_id)
        return found

    def _walk(self, viewpoint: Viewpoint, shown: list[str]) -> None:
        """Go there. A refused step changes nothing and is not part of the trajectory: it is walked around."""
        target = self._view.objects[shown[0]].object_type
        while (moves := self._moves(viewpoint)) is not None:
            if all(self._move(action) for action in moves):
                break
        else:
            raise RolloutError(f"no way to {target}")
        if not all(self._view.objects[key].visible for key in shown):
            raise RolloutError(f"{target} is out of sight after walking to it")

    def _moves(self, viewpoint: Viewpoint) -> list[str] | None:
        """The actions that lead to a viewpoint."""
        grid = self._cells()
        path = grid.path(stand_of(self._view, grid), viewpoint.stand)
        return None if path is None else path + self._looks(viewpoint)

    def _cells(self) -> Grid:
        if self._grid is None:
            self._grid = reachable(self.simulator)
        return self._grid

    def _looks(self, viewpoint: Viewpoint) -> list[str]:
        steps = round((viewpoint.horizon - self._view.agent.horizon) / HORIZON_STEP)
        return ["LookDown" if steps > 0 else "LookUp"] * abs(steps)

    def _move(self, action: str) -> bool:
        """One step of a walk; False where something is in the way, which the grid then knows."""
        if action != "MoveAhead":
            degrees = _TURN if action.startswith("Rotate") else HORIZON_STEP
            self._act(ApiAction(action), {"degrees": float(degrees)}, str(degrees))
            return True
        grid = self._cells()
        stand = stand_of(self._view, grid)
        try:
            self._act(ApiAction(action, move_magnitude=GRID), {"moveMagnitude": GRID}, "25")
        except RolloutError:
            self._grid = grid.without(stand.ahead)
            return False
        return True

    # -- single actions

    def _interact(self, action: str, item: str, receptacle: str | None = None) -> None:
        """An action on an object, stored in the form that trajectories have (the held object and its
        receptacle)."""
        acted_on = item if receptacle is None else receptacle
        if acted_on not in self._view.objects:
            raise RolloutError(f"{action}: {acted_on.split('|')[0]} is gone")
        if not self._view.objects[acted_on].visible:
            # A thing just put down or uncovered may lie where it cannot be seen from here: step aside.
            self._walk(self._viewpoint([acted_on]), [acted_on])
        api = ApiAction(action, object_id=item, receptacle_id=receptacle)
        self._act(api, {"objectId": acted_on})
        self._grid = None  # a door or a thing on the floor may be in the way now, or no longer

    def _act(self, api: ApiAction, arguments: dict[str, Any], suffix: str = "") -> None:
        before = self._view
        after = self.simulator.step(api.action, **arguments)
        if not after.success:
            raise RolloutError(f"{api.action}: {after.error}", api.object_id, api.receptacle_id)
        name = f"{api.action}_{suffix}" if suffix else api.action
        low = LowAction(api, self.first_high + len(self.high) - 1, DiscreteAction(name, _box(before, arguments)))
        self.acted.append(Acted(low, after, api.object_id, api.receptacle_id))

    # -- what is where

    @property
    def _view(self) -> View:
        return self.simulator.view

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


def _box(view: View, arguments: dict[str, Any]) -> dict[str, Any]:
    """The box of the object acted on, as trajectories store it with the action."""
    shown = (view.instances or {}).get(arguments.get("objectId", ""))
    return {} if shown is None else {"bbox": list(shown.box)}
