"""Objects of their type's usual size: for procedural scenes, and for what a recording names without
describing."""

import numpy as np

from infthor_sim.geometry import Array, object_id
from infthor_sim.object_types import type_named
from infthor_sim.objects import SimObject, SimObjectState

__all__ = ["default_object", "style_of"]


def style_of(name: str) -> int:
    """Return a number that varies colours; always the same for the same name."""
    return sum(ord(letter) * (index + 1) for index, letter in enumerate(name))


def default_object(
    object_type: str, position: Array, yaw: float = 0.0, size: Array | None = None
) -> SimObject:
    """Return an object of its type's usual size, or of another."""
    declared = type_named(object_type)
    box = np.array(declared.size if size is None else size, dtype=float)
    new_id = object_id(object_type, position)
    return SimObject(
        object_id=new_id,
        name=f"{object_type}_{style_of(new_id):08x}",
        type=declared,
        position=np.asarray(position, dtype=float).copy(),
        rotation=np.array([0.0, yaw % 360.0, 0.0]),
        box_center=np.zeros(3) if declared.centered else np.array([0.0, box[1] / 2, 0.0]),
        box_size=box,
        support=declared.support_height(float(box[1])),
        style=style_of(new_id),
        state=SimObjectState(openness=1.0 if declared.starts_open else 0.0),
    )
