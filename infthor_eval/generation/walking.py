"""Walking to poses from which objects can be acted on, replanned when a step is refused."""

from infthor_eval.formats.trajectory import ApiAction, PlannerAction
from infthor_eval.generation.trace import RolloutError, Trace
from infthor_eval.household.navigation import GRID, Grid
from infthor_eval.household.scout import (
    HORIZON_STEP,
    Viewpoint,
    find_viewpoint,
    grid_pose_of,
    reachable_grid,
)
from infthor_eval.household.wording import compact_name

_TURN = 90  # degrees
_MIN_PIXELS = 60  # minimum size of the object acted on, in a frame of 90,000 pixels


class Walker:
    """Walks for a rollout and adds the actions to its trace."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._grid: Grid | None = None

    def go(self, object_ids: list[str], inside: str | None = None) -> None:
        """Walk to where objects can be acted on; a sub-goal, unless the agent is there already.

        Args:
            object_ids: ids of the objects; the agent faces the first.
            inside: id of an object hidden in the first one.

        Raises:
            RolloutError: there is no such pose, or no path to it.
        """
        target = self._trace.view.objects[object_ids[0]]
        viewpoint = self._viewpoint(object_ids, inside)
        if self._moves(viewpoint) == []:
            return
        self._begin(viewpoint, target.object_id)
        self._walk(viewpoint, object_ids)

    def stand(self, viewpoint: Viewpoint, towards: str) -> None:
        """Walk to a pose, a sub-goal that names an object.

        Raises:
            RolloutError: there is no path to it.
        """
        self._begin(viewpoint, towards)
        self._walk(viewpoint, [])

    def turn_around(self) -> None:
        """Turn once about, in the current sub-goal."""
        for _ in range(360 // _TURN):
            self._move("RotateRight")

    def _begin(self, viewpoint: Viewpoint, towards: str) -> None:
        x, z = viewpoint.pose.cell
        facing = viewpoint.pose.facing
        location = f"loc|{x}|{z}|{facing // _TURN}|{viewpoint.horizon}"
        action = PlannerAction("GotoLocation", location=location, object_id=towards)
        words = [compact_name(self._trace.view.objects[towards].object_type)]
        self._trace.begin(words, action)

    def step_aside(self, item: str, inside: str | None = None) -> None:
        """Walk to where an object can be acted on, within the current sub-goal; see `go`."""
        self._walk(self._viewpoint([item], inside), [item])

    def forget_grid(self) -> None:
        """Discard the cached grid, after an action that may have blocked or freed cells."""
        self._grid = None

    def _viewpoint(self, object_ids: list[str], inside: str | None = None) -> Viewpoint:
        """Return a pose from which the objects can be acted on."""
        viewpoint = find_viewpoint(
            self._trace.simulator, self._cells(), object_ids, inside, _MIN_PIXELS
        )
        if viewpoint is None:
            target = self._trace.view.objects[inside or object_ids[0]]
            raise RolloutError(f"no place to reach {target.object_type} from", target.object_id)
        return viewpoint

    def _walk(self, viewpoint: Viewpoint, object_ids: list[str]) -> None:
        # A refused step changes nothing and is not part of the trajectory. Its cell is removed from
        # the grid, so that the next path leads around it.
        target = self._trace.view.objects[object_ids[0]].object_type if object_ids else "the place"
        while (moves := self._moves(viewpoint)) is not None:
            last = len(moves) - 1
            if all(self._move(it, is_seen=number == last) for number, it in enumerate(moves)):
                break
        else:
            raise RolloutError(f"no way to {target}")
        if not all(self._trace.view.objects[key].visible for key in object_ids):
            raise RolloutError(f"{target} is out of sight after walking to it")

    def _moves(self, viewpoint: Viewpoint) -> list[str] | None:
        """Return the actions to a viewpoint, or None if there is no path."""
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

    def _move(self, action: str, is_seen: bool = True) -> bool:
        """Execute one action of a walk; returns False if blocked, and removes the cell.

        Which objects its frame shows is asked where something may be acted on next (`is_seen`).
        """
        quiet = {} if is_seen else {"renderInstanceSegmentation": False}
        if action != "MoveAhead":
            degrees = _TURN if action.startswith("Rotate") else HORIZON_STEP
            turn = {"degrees": float(degrees), **quiet}
            self._trace.act(ApiAction(action), turn, str(degrees))
            return True
        grid = self._cells()
        pose = grid_pose_of(self._trace.view.agent, grid)
        try:
            ahead = {"moveMagnitude": GRID, **quiet}
            self._trace.act(ApiAction(action, move_magnitude=GRID), ahead, "25")
        except RolloutError:
            self._grid = grid.without_cell(pose.ahead)
            return False
        return True
