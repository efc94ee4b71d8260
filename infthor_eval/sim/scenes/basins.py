"""Basins: objects of their own, let into sinks and bathtubs, as those are let into counters."""

from infthor_eval.sim.footprints import Rect, without
from infthor_eval.sim.objects import SimObject

__all__ = ["around", "name_after"]


def name_after(outer: SimObject, basin: SimObject) -> None:
    """Give a basin the id and name that AI2-THOR makes of those of the sink or tub that it is in."""
    basin.object_id = f"{outer.object_id}|{basin.object_type}"
    basin.name = f"{basin.object_type}_{outer.name.split('_')[1]}"


def around(outer: SimObject, inner: SimObject) -> tuple[Rect, ...]:
    """The plan of `outer` less that of `inner`; both look the same way."""
    middle = outer.matrix.T @ (inner.center - outer.center)
    whole, hole = outer.box_size / 2, inner.box_size / 2
    return without(
        (-float(whole[0]), -float(whole[2]), float(whole[0]), float(whole[2])),
        [(middle[0] - hole[0], middle[2] - hole[2], middle[0] + hole[0], middle[2] + hole[2])],
    )
