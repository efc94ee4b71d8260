"""Whether an object is visible, compiled by numba: it stops at enough pixels."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.primitives import BOTTOM, FORM, TOP
from infthor_sim.render.raster_numba import hit

__all__ = ["is_visible"]

# every eighth row and column is tried first: an object in full view shows up there already
_COARSE = 8


def is_visible(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    own: NDArray[np.bool_],
    min_pixels: int,
) -> bool:
    """Return whether at least `min_pixels` pixels show a primitive marked in `own` (n,)."""
    us, vs = camera.rays()
    profiles = prims[projection.index][:, [FORM, BOTTOM, TOP]]
    enough = _is_visible(
        profiles, projection.origin, projection.steps, projection.box, projection.near, us, vs,
        camera.near, camera.far,
        np.nonzero(own)[0], np.nonzero(~own)[0], min_pixels,
    )  # fmt: skip
    return bool(enough)


@njit(cache=True, error_model="numpy", inline="always")
def _depth(
    profiles: Array, origin: Array, steps: Array, k: int, u: float, v: float, clip: float
) -> float:
    o = origin[k]
    step = steps[k]
    dx = (step[0, 0] + u * step[1, 0]) + v * step[2, 0]
    dy = (step[0, 1] + u * step[1, 1]) + v * step[2, 1]
    dz = (step[0, 2] + u * step[1, 2]) + v * step[2, 2]
    return hit(profiles[k, 0], profiles[k, 1], profiles[k, 2], o[0], o[1], o[2], dx, dy, dz, clip)


@njit(cache=True, error_model="numpy", inline="always")
def _covers(box: NDArray[np.int64], k: int, x: int, y: int) -> bool:
    return box[k, 0] <= x <= box[k, 1] and box[k, 2] <= y <= box[k, 3]


@njit(cache=True, error_model="numpy")
def _is_visible(
    profiles: Array,
    origin: Array,
    steps: Array,
    box: NDArray[np.int64],
    near: Array,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    own: NDArray[np.int64],
    others: NDArray[np.int64],
    min_pixels: int,
) -> bool:
    hider = -1  # what hid the last pixel is tried first, as it mostly hides the next one too
    for every in (_COARSE, 1):
        count = 0  # the fine pass counts all pixels afresh, those of the coarse one among them
        for y in range(box[own, 2].min() + every // 2, box[own, 3].max() + 1, every):
            for x in range(box[own, 0].min() + every // 2, box[own, 1].max() + 1, every):
                u, v = us[x], vs[y]
                # of the object's own nearest primitive
                depth = far
                first = -1
                for k in own:
                    if _covers(box, k, x, y) and near[k] < depth:
                        t = _depth(profiles, origin, steps, k, u, v, clip)
                        if clip < t < depth:
                            depth = t
                            first = k
                if first < 0:
                    continue
                hidden = False
                for n in range(-1, len(others)):
                    k = others[n] if n >= 0 else hider
                    if k >= 0 and _covers(box, k, x, y) and near[k] <= depth:
                        t = _depth(profiles, origin, steps, k, u, v, clip)
                        # Ties go to the earlier primitive, as in the ray caster, with whose picture
                        # this must agree.
                        if t > clip and (t < depth or (t == depth and k < first)):
                            hider = k
                            hidden = True
                            break
                count += 0 if hidden else 1
                if count >= min_pixels:
                    return True
    return False
