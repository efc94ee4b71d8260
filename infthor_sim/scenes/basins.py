"""Basins: separate objects inside sinks and bathtubs, as sinks are inside counters."""

from infthor_sim.objects import SimObject
from infthor_sim.physics.footprints import Rect, subtract

__all__ = ["name_after", "rim_pieces"]


def name_after(outer: SimObject, basin: SimObject) -> None:
    """Give a basin the id and name that AI2-THOR derives from those of its sink or tub."""
    basin.object_id = f"{outer.object_id}|{basin.object_type}"
    basin.name = f"{basin.object_type}_{outer.name.split('_')[1]}"


def rim_pieces(outer: SimObject, inner: SimObject) -> tuple[Rect, ...]:
    """Return the outline of `outer` from above without that of `inner`; both have the same yaw."""
    middle = outer.matrix.T @ (inner.center - outer.center)
    whole = outer.box_size / 2
    hole = inner.box_size / 2
    return subtract(
        (-float(whole[0]), -float(whole[2]), float(whole[0]), float(whole[2])),
        [(middle[0] - hole[0], middle[2] - hole[2], middle[0] + hole[0], middle[2] + hole[2])],
    )
