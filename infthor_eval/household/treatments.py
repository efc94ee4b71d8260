"""What was washed, heated and cooled for real: AI2-THOR's objects do not tell it, so it is followed action by action.

The rules are ALFRED's: a tap that is turned on cleans what lies in the basin below it, a microwave that is turned on
heats what is in it, and a fridge that is closed cools what is in it.
"""

import math
from dataclasses import dataclass, replace

from infthor_eval.household.containment import contents_of
from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = ["Treatments"]

_BASINS = {"SinkBasin", "BathtubBasin"}


@dataclass(frozen=True)
class Treatments:
    """Ids of the objects that were treated since this was empty; whoever follows a task begins with none.

    The sets only grow, as in ALFRED: a hot potato in the fridge is hot and, once that is closed, cold. In the planner's
    `State` the later treatment replaces the earlier, which it can, because there nothing but `CoolObject` cools; here
    the closing door would undo "put a hot potato in the fridge". Slices are objects of their own and begin untreated.

    Attributes:
        clean: the washed ones.
        hot: the heated ones.
        cold: the cooled ones.
    """

    clean: frozenset[str] = frozenset()
    hot: frozenset[str] = frozenset()
    cold: frozenset[str] = frozenset()

    def after(self, action: str, object_id: str | None, view: SimulatorView) -> "Treatments":
        """What is treated once an action was tried.

        Args:
            action: its name, in AI2-THOR's 5.x form.
            object_id: what it was about, as the simulator names it.
            view: the world after it; a refused action treats nothing.
        """
        tool = view.objects.get(object_id or "")
        if not view.success or tool is None:
            return self
        if action == "ToggleObjectOn" and tool.object_type == "Faucet":
            basin = _basin_of(tool, view)
            return (
                self if basin is None else replace(self, clean=self.clean | contents_of(basin.object_id, view.objects))
            )
        if action == "ToggleObjectOn" and tool.object_type == "Microwave":
            return replace(self, hot=self.hot | contents_of(tool.object_id, view.objects))
        if action == "CloseObject" and tool.object_type == "Fridge":
            return replace(self, cold=self.cold | contents_of(tool.object_id, view.objects))
        return self


def _basin_of(faucet: ThorObject, view: SimulatorView) -> ThorObject | None:
    """The basin that a tap runs into: the nearest one.

    ALFRED looks among the sinks' alone, so that filling a bathtub washes what lies in the sink across the room.
    """
    basins = [item for item in view.objects.values() if item.object_type in _BASINS]
    return min(basins, key=lambda item: (_gap(item, faucet), item.object_id), default=None)


def _gap(one: ThorObject, other: ThorObject) -> float:
    """Distance in metres."""
    return math.dist(
        (one.position.x, one.position.y, one.position.z), (other.position.x, other.position.y, other.position.z)
    )
