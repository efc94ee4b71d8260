"""Walking to where objects can be acted on, planned on the grid as it comes."""

from infthor_eval.formats.trajectory import ApiAction, PlannerAction
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.household.navigation import GRID, Grid
from infthor_eval.household.scout import HORIZON_STEP, Viewpoint, find_viewpoint, grid_pose_of, reachable_grid
from infthor_eval.household.wording import compact_name

__all__ = ["Walker"]

_TURN = 90
_MIN_PIXELS = 60  # of what is acted on, in a frame of 90,000


class Walker:
    """Walks for a rollout, and adds its steps to the trace."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._grid: Grid | None = None

    def go(self, shown: list[str], inside: str | None = None) -> None:
        """Walk to where objects can be acted on, as a sub-goal of its own where there is a step to go.

        Args:
            shown: ids of the objects; the first is what the agent faces.
            inside: id of an object that is hidden in the first.

        Raises:
            RolloutError: there is no such place, or no way to it.
        """
        target = self._trace.view.objects[shown[0]]
        viewpoint = self._viewpoint(shown, inside)
        if self._moves(viewpoint) == []:
            return
        (x, z), facing = viewpoint.pose.cell, viewpoint.pose.facing
        location = f"loc|{x}|{z}|{facing // _TURN}|{viewpoint.horizon}"
        action = PlannerAction("GotoLocation", location=location, object_id=target.object_id)
        self._trace.begin([compact_name(target.object_type)], action)
        self._walk(viewpoint, shown)

    def step_aside(self, item: str) -> None:
        """Walk to where an object is in sight, within the present sub-goal.

        Raises:
            RolloutError: as `go`.
        """
        self._walk(self._viewpoint([item]), [item])

    def forget_grid(self) -> None:
        """Forget where the agent can stand: things may be in the way now, or no longer."""
        self._grid = None

    def _viewpoint(self, shown: list[str], inside: str | None = None) -> Viewpoint:
        """Where to act on the objects from."""
        found = find_viewpoint(self._trace.simulator, self._cells(), shown, inside, _MIN_PIXELS)
        if found is None:
            target = self._trace.view.objects[inside or shown[0]]
            raise RolloutError(f"no place to reach {target.object_type} from", target.object_id)
        return found

    def _walk(self, viewpoint: Viewpoint, shown: list[str]) -> None:
        """Go there. A refused step changes nothing and is not part of the trajectory: it is walked around."""
        target = self._trace.view.objects[shown[0]].object_type
        while (moves := self._moves(viewpoint)) is not None:
            if all(self._move(action) for action in moves):
                break
        else:
            raise RolloutError(f"no way to {target}")
        if not all(self._trace.view.objects[key].visible for key in shown):
            raise RolloutError(f"{target} is out of sight after walking to it")

    def _moves(self, viewpoint: Viewpoint) -> list[str] | None:
        """The actions that lead to a viewpoint."""
        grid = self._cells()
        path = grid.path(grid_pose_of(self._trace.view.agent, grid), viewpoint.pose)
        return None if path is None else path + self._looks(viewpoint)

    def _cells(self) -> Grid:
        if self._grid is None:
            self._grid = reachable_grid(self._trace.simulator)
        return self._grid

    def _looks(self, viewpoint: Viewpoint) -> list[str]:
        steps = round((viewpoint.horizon - self._trace.view.agent.horizon) / HORIZON_STEP)
        return ["LookDown" if steps > 0 else "LookUp"] * abs(steps)

    def _move(self, action: str) -> bool:
        """One step of a walk; False where something is in the way, which the grid then knows."""
        if action != "MoveAhead":
            degrees = _TURN if action.startswith("Rotate") else HORIZON_STEP
            self._trace.act(ApiAction(action), {"degrees": float(degrees)}, str(degrees))
            return True
        grid = self._cells()
        stand = grid_pose_of(self._trace.view.agent, grid)
        try:
            self._trace.act(ApiAction(action, move_magnitude=GRID), {"moveMagnitude": GRID}, "25")
        except RolloutError:
            self._grid = grid.without_cell(stand.ahead)
            return False
        return True
