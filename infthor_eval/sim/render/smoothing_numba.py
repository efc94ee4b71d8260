"""Smoothing of jagged pixels, compiled by numba."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import PinholeCamera, Projection
from infthor_eval.sim.render.lighting import Lights
from infthor_eval.sim.render.primitives import BOTTOM, COLOR, FORM, TOP
from infthor_eval.sim.render.raster_numba import hit
from infthor_eval.sim.render.shading_numba import brightness_at, eye_of
from infthor_eval.sim.render.smoothing import JUMP, NEIGHBOURS, SUBPIXELS
from infthor_eval.sim.render.table import ORIGIN, STEPS, shading_table

__all__ = ["smooth"]

_NEIGHBOURS, _SUBPIXELS = np.array(NEIGHBOURS), np.array(SUBPIXELS)


def smooth(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    nearest: NDArray[np.int32],
    factors: Array,
    lights: Lights,
    rgb: NDArray[np.uint8],
) -> None:
    """Give the jagged pixels of `rgb` the mean colour of their rays, in place."""
    us, vs = camera.rays()
    table = shading_table(prims, projection, lights)
    _smooth(
        table, len(projection.index), eye_of(camera), us, vs, camera.near, camera.far, nearest, factors,
        lights.daylight, _find_jagged(rgb), rgb,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _find_jagged(rgb: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return the row and column (n, 2) of each pixel that differs much from a neighbour."""
    height, width, _ = rgb.shape
    total = np.empty((height, width), dtype=np.int16)
    for y in range(height):
        for x in range(width):
            total[y, x] = np.int16(rgb[y, x, 0]) + np.int16(rgb[y, x, 1]) + np.int16(rgb[y, x, 2])
    marked = np.zeros((height, width), dtype=np.uint8)
    for y in range(height):
        for x in range(width - 1):
            jump = np.uint8(abs(total[y, x + 1] - total[y, x]) > JUMP)
            marked[y, x] |= jump
            marked[y, x + 1] |= jump
    for y in range(height - 1):
        for x in range(width):
            jump = np.uint8(abs(total[y + 1, x] - total[y, x]) > JUMP)
            marked[y, x] |= jump
            marked[y + 1, x] |= jump
    places, count = np.empty((height * width, 2), dtype=np.int64), 0
    for y in range(height):
        for x in range(width):
            if marked[y, x]:
                places[count, 0], places[count, 1] = y, x
                count += 1
    return places[:count]


@njit(cache=True, error_model="numpy")
def _candidates(nearest: NDArray[np.int32], y: int, x: int, orders: NDArray[np.int32], at: NDArray[np.int64]) -> int:
    """Write the primitives that a pixel and its neighbours show to `orders`, and where to `at`; return how many."""
    count = 0
    for j in range(len(_NEIGHBOURS)):
        yy, xx = y + _NEIGHBOURS[j, 0], x + _NEIGHBOURS[j, 1]
        if yy < 0 or xx < 0 or yy >= nearest.shape[0] or xx >= nearest.shape[1] or nearest[yy, xx] < 0:
            continue
        order, listed = nearest[yy, xx], False
        for k in range(count):
            listed = listed or orders[k] == order
        if not listed:
            orders[count], at[count, 0], at[count, 1] = order, yy, xx
            count += 1
    return count


@njit(cache=True, error_model="numpy", inline="always")
def _depth(table: Array, k: int, u: float, v: float, clip: float) -> float:
    dx = (table[k, STEPS] + u * table[k, STEPS + 3]) + v * table[k, STEPS + 6]
    dy = (table[k, STEPS + 1] + u * table[k, STEPS + 4]) + v * table[k, STEPS + 7]
    dz = (table[k, STEPS + 2] + u * table[k, STEPS + 5]) + v * table[k, STEPS + 8]
    ox, oy, oz = table[k, ORIGIN], table[k, ORIGIN + 1], table[k, ORIGIN + 2]
    return hit(table[k, FORM], table[k, BOTTOM], table[k, TOP], ox, oy, oz, dx, dy, dz, clip)


@njit(cache=True, error_model="numpy")
def _smooth(
    table: Array,
    first: int,
    eye: Any,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    nearest: NDArray[np.int32],
    factors: Array,
    daylight: float,
    jagged: NDArray[np.int64],
    rgb: NDArray[np.uint8],
) -> None:
    pixel = vs[1] - vs[0] if len(vs) > 1 else 0.0
    # Each pixel reads and writes only its own colour: smoothing in place needs no copy.
    orders = np.empty(len(_NEIGHBOURS), dtype=np.int32)
    at = np.empty((len(_NEIGHBOURS), 2), dtype=np.int64)
    for place in range(len(jagged)):
        y, x = jagged[place, 0], jagged[place, 1]
        count = _candidates(nearest, y, x, orders, at)
        red, green, blue = 0.0, 0.0, 0.0
        for part in range(len(_SUBPIXELS)):
            u, v = us[x] + _SUBPIXELS[part, 0] * pixel, vs[y] + _SUBPIXELS[part, 1] * pixel
            best, chosen = math.inf, -1
            for k in range(count):
                t = _depth(table, orders[k], u, v, clip)
                if clip < t < far and t < best:
                    best, chosen = t, k
            if chosen < 0:  # the ray misses all candidates: the pixel's own colour is taken
                red, green, blue = red + rgb[y, x, 0], green + rgb[y, x, 1], blue + rgb[y, x, 2]
                continue
            order = orders[chosen]
            # The crease factor is that of the pixel that showed the primitive, as there is no depth around the ray.
            level = brightness_at(table, first, order, u, v, best, eye, daylight)
            level = level * factors[at[chosen, 0], at[chosen, 1]]
            red += min(table[order, COLOR] * level * 255.0, 255.0)
            green += min(table[order, COLOR + 1] * level * 255.0, 255.0)
            blue += min(table[order, COLOR + 2] * level * 255.0, 255.0)
        rgb[y, x, 0] = np.uint8(red / len(_SUBPIXELS))
        rgb[y, x, 1] = np.uint8(green / len(_SUBPIXELS))
        rgb[y, x, 2] = np.uint8(blue / len(_SUBPIXELS))
