"""What opening does to the box of a thing that has no door or drawer: lids rise, flaps spread, blinds come down."""

import numpy as np

from infthor_eval.sim.geometry import yaw_matrix
from infthor_eval.sim.objects import SimObject

__all__ = ["unfold"]


def unfold(item: SimObject, openness: float) -> None:
    """Give an object the box that it has when it is open so far; its present one belongs to its present openness."""
    turn, before = yaw_matrix(item.front), item.state.openness
    for way in item.type.unfolds:
        step = turn @ np.eye(3)[way.axis]  # of the object's own frame, along the axis as one sees it from its front
        own = int(np.argmax(np.abs(step)))
        size = way.extent(float(item.box_size[own]), before, openness)
        grown = size - item.box_size[own]
        item.box_center = item.box_center - way.stays * grown / 2 * step
        item.box_size = np.where(np.arange(3) == own, size, item.box_size)
