"""Boxes that change with opening, of objects without door or drawer: lids rise, flaps spread,
blinds come down."""

import numpy as np

from infthor_sim.geometry import yaw_matrix
from infthor_sim.objects import SimObject

__all__ = ["unfold"]


def unfold(item: SimObject, openness: float) -> None:
    """Change an object's box from that at its present openness to that at `openness`."""
    turn = yaw_matrix(item.front)
    before = item.state.openness
    for way in item.type.unfolds:
        # The axis is given as seen from the front; `step` is its direction in the object's own
        # frame.
        step = turn @ np.eye(3)[way.axis]
        own = int(np.argmax(np.abs(step)))
        size = way.extent(float(item.box_size[own]), before, openness)
        grown = size - item.box_size[own]
        item.box_center = item.box_center - way.stays * grown / 2 * step
        item.box_size = np.where(np.arange(3) == own, size, item.box_size)
