"""How much of one thing a camera sees, without drawing the rest of the picture."""

from dataclasses import replace

import numpy as np

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, project
from infthor_eval.sim.render.picture import Rasterizer
from infthor_eval.sim.render.primitives import INSTANCE

__all__ = ["pixels_of"]


def pixels_of(prims: Array, instance: int, camera: Camera, rasterizer: Rasterizer) -> int:
    """Number of pixels that show an instance; only the part of the picture around it is cast."""
    own = project(prims[prims[:, INSTANCE] == instance], camera)
    if not len(own.index):
        return 0
    seen = project(prims, camera)
    low, high = own.box[:, [0, 2]].min(axis=0), own.box[:, [1, 3]].max(axis=0)
    box = seen.box.copy()
    box[:, [0, 2]] = np.maximum(box[:, [0, 2]], low)
    box[:, [1, 3]] = np.minimum(box[:, [1, 3]], high)
    near = np.nonzero((box[:, 0] <= box[:, 1]) & (box[:, 2] <= box[:, 3]))[0]
    around = replace(
        seen,
        index=seen.index[near],
        origin=np.ascontiguousarray(seen.origin[near]),
        steps=np.ascontiguousarray(seen.steps[near]),
        box=np.ascontiguousarray(box[near]),
        near=seen.near[near],
    )
    _, nearest = rasterizer.cast(prims, around, camera)
    lookup = np.append(prims[around.index, INSTANCE], -1)
    return int(np.count_nonzero(lookup[nearest] == instance))
