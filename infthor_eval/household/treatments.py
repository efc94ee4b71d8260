"""Tracking of what was washed, heated and cooled, which AI2-THOR's metadata does not record.

The rules are ALFRED's: turning on a tap cleans what is in the basin below it, turning on a
microwave heats what is in it, and closing a fridge cools what is in it.
"""

import math
from dataclasses import dataclass, replace

from msgspec.structs import astuple

from infthor_eval.household.containment import contents_of
from infthor_eval.thor.view import SimulatorView, ThorObject

_BASINS = {"SinkBasin", "BathtubBasin"}


@dataclass(frozen=True)
class Treatments:
    """Ids of the objects that were treated since the start of a task, at which the sets are empty.

    The sets only grow, as in ALFRED: a hot potato in the fridge is both hot and, after closing the
    door, cold. Otherwise closing the door would undo "put a hot potato in the fridge". In the
    planner's `State` the later treatment replaces the earlier one, as there only `CoolObject`
    cools. Slices are separate objects and start untreated.

    Attributes:
        clean: washed objects.
        hot: heated objects.
        cold: cooled objects.
    """

    clean: frozenset[str] = frozenset()
    hot: frozenset[str] = frozenset()
    cold: frozenset[str] = frozenset()

    def after(self, action: str, object_id: str | None, view: SimulatorView) -> "Treatments":
        """Return the treatments after an action.

        Args:
            action: name of the action in AI2-THOR 5.x.
            object_id: the simulator's id of the object acted on.
            view: state after the action; a refused action treats nothing.
        """
        tool = view.objects.get(object_id or "")
        if not view.success or tool is None:
            return self
        if action == "ToggleObjectOn" and tool.object_type == "Faucet":
            basin = _basin_of(tool, view)
            inside = (
                frozenset[str]() if basin is None else contents_of(basin.object_id, view.objects)
            )
            return replace(self, clean=self.clean | inside)
        if action == "ToggleObjectOn" and tool.object_type == "Microwave":
            return replace(self, hot=self.hot | contents_of(tool.object_id, view.objects))
        if action == "CloseObject" and tool.object_type == "Fridge":
            return replace(self, cold=self.cold | contents_of(tool.object_id, view.objects))
        return self


def _basin_of(faucet: ThorObject, view: SimulatorView) -> ThorObject | None:
    """Return the basin nearest to a tap.

    ALFRED considers only sink basins, so that there filling a bathtub washes what is in a sink
    across the room.
    """
    basins = [basin for basin in view.objects.values() if basin.object_type in _BASINS]
    at = astuple(faucet.position)
    return min(
        basins,
        key=lambda basin: (math.dist(astuple(basin.position), at), basin.object_id),
        default=None,
    )
