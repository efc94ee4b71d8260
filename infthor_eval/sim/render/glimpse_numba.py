"""Whether a thing is seen at all, compiled by numba: it stops as soon as enough pixels show it."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, Projection
from infthor_eval.sim.render.primitives import BOTTOM, FORM, TOP
from infthor_eval.sim.render.raster_numba import hit

__all__ = ["shows"]

_THINNED = 8  # one row and column in so many is tried first: what is in full view is found there


def shows(prims: Array, seen: Projection, camera: Camera, own: NDArray[np.bool_], least: int) -> bool:
    """Whether at least `least` pixels show one of the primitives that are marked in `own` (n,), by order in `seen`."""
    us, vs = camera.rays()
    profiles = prims[seen.index][:, [FORM, BOTTOM, TOP]]
    found = _shows(
        profiles, seen.origin, seen.steps, seen.box, seen.near, us, vs, camera.near, camera.far,
        np.nonzero(own)[0], np.nonzero(~own)[0], least,
    )  # fmt: skip
    return bool(found)


@njit(cache=True, inline="always")
def _depth(profiles: Array, origin: Array, steps: Array, k: int, u: float, v: float, clip: float) -> float:
    o, step = origin[k], steps[k]
    dx = (step[0, 0] + u * step[1, 0]) + v * step[2, 0]
    dy = (step[0, 1] + u * step[1, 1]) + v * step[2, 1]
    dz = (step[0, 2] + u * step[1, 2]) + v * step[2, 2]
    return hit(profiles[k, 0], profiles[k, 1], profiles[k, 2], o[0], o[1], o[2], dx, dy, dz, clip)


@njit(cache=True, inline="always")
def _covers(box: NDArray[np.int64], k: int, x: int, y: int) -> bool:
    return box[k, 0] <= x <= box[k, 1] and box[k, 2] <= y <= box[k, 3]


@njit(cache=True)
def _shows(
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
    least: int,
) -> bool:
    hider = -1  # what hid the last pixel mostly hides the next one too
    for every in (_THINNED, 1):
        count = 0
        for y in range(box[own, 2].min() + every // 2, box[own, 3].max() + 1, every):
            for x in range(box[own, 0].min() + every // 2, box[own, 1].max() + 1, every):
                u, v = us[x], vs[y]
                depth, first = far, -1
                for k in own:
                    if _covers(box, k, x, y) and near[k] < depth:
                        t = _depth(profiles, origin, steps, k, u, v, clip)
                        if clip < t < depth:
                            depth, first = t, k
                if first < 0:
                    continue
                hidden = False
                for n in range(-1, len(others)):
                    k = others[n] if n >= 0 else hider
                    if k >= 0 and _covers(box, k, x, y) and near[k] <= depth:
                        t = _depth(profiles, origin, steps, k, u, v, clip)
                        if t > clip and (t < depth or (t == depth and k < first)):
                            hider, hidden = k, True
                            break
                count += 0 if hidden else 1
                if count >= least:
                    return True
    return False
