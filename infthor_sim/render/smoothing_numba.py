"""Anti-aliasing: which pixels are jagged, and the rays that smooth them; compiled by numba.

Only pixels at a jump of brightness are smoothed. Four rays through such a pixel are tested against
the primitives that the pixel and its neighbours show, and no others. That misses what no pixel near
shows, but costs little.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import BOTTOM, COLOR, FORM, TOP
from infthor_sim.render.raster_numba import hit
from infthor_sim.render.shading_numba import brightness, eye_of
from infthor_sim.render.table import ORIGIN, STEPS, shading_table

__all__ = ["JUMP", "NEIGHBOURS", "SUBPIXELS", "smooth"]

JUMP = 48  # of brightness between neighbours, as the sum of three channels (of 765)
# A rotated grid: no two rays share a row or column, so that nearly level and nearly upright edges
# get all four steps.
SUBPIXELS = np.array([(-0.125, -0.375), (0.375, -0.125), (-0.375, 0.125), (0.125, 0.375)])
"""Points of a pixel that the rays go through, from its middle, as shares of its width and
height."""
NEIGHBOURS = np.array(
    [(0, 0), (0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)]
)
"""The pixel and its neighbours, as offsets of row and column."""


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
        table, len(projection.index), eye_of(camera), us, vs, camera.near, camera.far, nearest,
        factors,
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
    positions = np.empty((height * width, 2), dtype=np.int64)
    count = 0
    for y in range(height):
        for x in range(width):
            if marked[y, x]:
                positions[count, 0] = y
                positions[count, 1] = x
                count += 1
    return positions[:count]


@njit(cache=True, error_model="numpy")
def _candidates(
    nearest: NDArray[np.int32], y: int, x: int, orders: NDArray[np.int32], at: NDArray[np.int64]
) -> int:
    """Write what a pixel and its neighbours show to `orders`, where to `at`; return how many."""
    count = 0
    for j in range(len(NEIGHBOURS)):
        yy = y + NEIGHBOURS[j, 0]
        xx = x + NEIGHBOURS[j, 1]
        if (
            yy < 0
            or xx < 0
            or yy >= nearest.shape[0]
            or xx >= nearest.shape[1]
            or nearest[yy, xx] < 0
        ):
            continue
        order = nearest[yy, xx]
        listed = False
        for k in range(count):
            listed = listed or orders[k] == order
        if not listed:
            orders[count] = order
            at[count, 0] = yy
            at[count, 1] = xx
            count += 1
    return count


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
    parts = len(SUBPIXELS)
    # the primitive that each ray hits; -1 for none
    hits = np.full(len(jagged) * parts, -1, dtype=np.int32)
    ray_u = np.empty(len(hits))
    ray_v = np.empty(len(hits))
    depths = np.empty(len(hits))
    crease = np.empty(len(hits))
    levels = np.empty(len(hits))
    orders = np.empty(len(NEIGHBOURS), dtype=np.int32)
    at = np.empty((len(NEIGHBOURS), 2), dtype=np.int64)
    for index in range(len(jagged)):
        y, x = jagged[index, 0], jagged[index, 1]
        count = _candidates(nearest, y, x, orders, at)
        for part in range(parts):
            u, v = us[x] + SUBPIXELS[part, 0] * pixel, vs[y] + SUBPIXELS[part, 1] * pixel
            best = math.inf
            chosen = -1
            for k in range(count):
                order = orders[k]
                dx = (table[order, STEPS] + u * table[order, STEPS + 3]) + v * table[
                    order, STEPS + 6
                ]
                dy = (table[order, STEPS + 1] + u * table[order, STEPS + 4]) + v * table[
                    order, STEPS + 7
                ]
                dz = (table[order, STEPS + 2] + u * table[order, STEPS + 5]) + v * table[
                    order, STEPS + 8
                ]
                ox = table[order, ORIGIN]
                oy = table[order, ORIGIN + 1]
                oz = table[order, ORIGIN + 2]
                t = hit(
                    table[order, FORM],
                    table[order, BOTTOM],
                    table[order, TOP],
                    ox,
                    oy,
                    oz,
                    dx,
                    dy,
                    dz,
                    clip,
                )
                if clip < t < far and t < best:
                    best = t
                    chosen = k
            if chosen >= 0:
                i = index * parts + part
                hits[i] = orders[chosen]
                ray_u[i] = u
                ray_v[i] = v
                depths[i] = best
                # The crease factor is that of the pixel that showed it, as there is no depth around
                # the ray.
                crease[i] = factors[at[chosen, 0], at[chosen, 1]]
    brightness(table, first, eye, daylight, hits, ray_u, ray_v, depths, levels)
    for index in range(len(jagged)):
        y, x = jagged[index, 0], jagged[index, 1]
        red = 0.0
        green = 0.0
        blue = 0.0
        for i in range(index * parts, (index + 1) * parts):
            order = hits[i]
            if order < 0:  # the ray misses all candidates: the pixel's own colour is taken
                red = red + rgb[y, x, 0]
                green = green + rgb[y, x, 1]
                blue = blue + rgb[y, x, 2]
                continue
            level = levels[i] * crease[i]
            red += min(table[order, COLOR] * level * 255.0, 255.0)
            green += min(table[order, COLOR + 1] * level * 255.0, 255.0)
            blue += min(table[order, COLOR + 2] * level * 255.0, 255.0)
        rgb[y, x, 0], rgb[y, x, 1], rgb[y, x, 2] = (
            np.uint8(red / parts),
            np.uint8(green / parts),
            np.uint8(blue / parts),
        )
