"""Smoothing of jagged pixels, compiled by numba."""

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import PinholeCamera, Projection
from infthor_eval.sim.render.lighting import Lights
from infthor_eval.sim.render.primitives import BOTTOM, COLOR, FORM, TOP
from infthor_eval.sim.render.raster_numba import hit
from infthor_eval.sim.render.shading_numba import brightness_at
from infthor_eval.sim.render.smoothing import NEIGHBOURS, SUBPIXELS

__all__ = ["smooth"]

_BANDS = 8  # parts of the list of pixels, smoothed in parallel
_NEIGHBOURS, _SUBPIXELS = np.array(NEIGHBOURS), np.array(SUBPIXELS)


def smooth(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    nearest: NDArray[np.int32],
    factors: Array,
    lights: Lights,
    places: tuple[NDArray[np.int64], NDArray[np.int64]],
    rgb: NDArray[np.uint8],
) -> None:
    """Give the pixels at `places` (rows, columns) of `rgb` the mean colour of their rays, in place."""
    us, vs = camera.rays()
    _smooth(
        prims[projection.index], projection.origin, projection.steps, camera.position, camera.matrix, us, vs,
        camera.near, camera.far, nearest, factors, lights.lamps, lights.daylight, places[0], places[1], rgb,
    )  # fmt: skip


@njit(cache=True, inline="always")
def _candidates(nearest: NDArray[np.int32], y: int, x: int, slots: NDArray[np.int64]) -> int:
    """Write to `slots` the indices of neighbours that show different primitives; return how many there are."""
    count = 0
    for j in range(len(_NEIGHBOURS)):
        yy, xx = y + _NEIGHBOURS[j, 0], x + _NEIGHBOURS[j, 1]
        if yy < 0 or xx < 0 or yy >= nearest.shape[0] or xx >= nearest.shape[1] or nearest[yy, xx] < 0:
            continue
        listed = False
        for k in range(count):
            slot = slots[k]
            listed = listed or nearest[y + _NEIGHBOURS[slot, 0], x + _NEIGHBOURS[slot, 1]] == nearest[yy, xx]
        if not listed:
            slots[count] = j
            count += 1
    return count


@njit(cache=True, inline="always")
def _depth(prims: Array, origin: Array, steps: Array, k: int, u: float, v: float, clip: float) -> float:
    dx = (steps[k, 0, 0] + u * steps[k, 1, 0]) + v * steps[k, 2, 0]
    dy = (steps[k, 0, 1] + u * steps[k, 1, 1]) + v * steps[k, 2, 1]
    dz = (steps[k, 0, 2] + u * steps[k, 1, 2]) + v * steps[k, 2, 2]
    ox, oy, oz = origin[k, 0], origin[k, 1], origin[k, 2]
    return hit(prims[k, FORM], prims[k, BOTTOM], prims[k, TOP], ox, oy, oz, dx, dy, dz, clip)


@njit(cache=True, parallel=True)
def _smooth(
    prims: Array,
    origin: Array,
    steps: Array,
    eye: Array,
    view: Array,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    nearest: NDArray[np.int32],
    factors: Array,
    lamps: Array,
    daylight: float,
    ys: NDArray[np.int64],
    xs: NDArray[np.int64],
    rgb: NDArray[np.uint8],
) -> None:
    pixel = vs[1] - vs[0] if len(vs) > 1 else 0.0
    # Each pixel reads and writes only its own colour: smoothing in place, in parallel, needs no copy.
    for band in prange(_BANDS):
        slots = np.empty(len(_NEIGHBOURS), dtype=np.int64)
        for place in range(band * len(ys) // _BANDS, (band + 1) * len(ys) // _BANDS):
            y, x = ys[place], xs[place]
            count = _candidates(nearest, y, x, slots)
            red, green, blue = 0.0, 0.0, 0.0
            for part in range(len(_SUBPIXELS)):
                u, v = us[x] + _SUBPIXELS[part, 0] * pixel, vs[y] + _SUBPIXELS[part, 1] * pixel
                best, chosen = math.inf, -1
                for k in range(count):
                    order = nearest[y + _NEIGHBOURS[slots[k], 0], x + _NEIGHBOURS[slots[k], 1]]
                    t = _depth(prims, origin, steps, order, u, v, clip)
                    if clip < t < far and t < best:
                        best, chosen = t, k
                if chosen < 0:  # the ray misses all candidates: the pixel's own colour is taken
                    red, green, blue = red + rgb[y, x, 0], green + rgb[y, x, 1], blue + rgb[y, x, 2]
                    continue
                # The crease factor is that of the pixel that showed the primitive, as there is no depth around the ray.
                yy, xx = y + _NEIGHBOURS[slots[chosen], 0], x + _NEIGHBOURS[slots[chosen], 1]
                order = nearest[yy, xx]
                level = brightness_at(prims, origin, steps, order, (u, v, best), eye, view, lamps, daylight)
                level = level * factors[yy, xx]
                red += min(prims[order, COLOR] * level * 255.0, 255.0)
                green += min(prims[order, COLOR + 1] * level * 255.0, 255.0)
                blue += min(prims[order, COLOR + 2] * level * 255.0, 255.0)
            rgb[y, x, 0] = np.uint8(red / len(_SUBPIXELS))
            rgb[y, x, 1] = np.uint8(green / len(_SUBPIXELS))
            rgb[y, x, 2] = np.uint8(blue / len(_SUBPIXELS))
