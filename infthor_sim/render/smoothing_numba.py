"""Anti-aliasing: which pixels are jagged, and the rays that smooth them; compiled by numba.

Only pixels at a jump of brightness are smoothed. Four rays through such a pixel are tested against
the primitives that the pixel and its neighbours show, and no others. That misses what no pixel near
shows, but costs little.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.grouping_numba import group
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import BOTTOM, COLOR, FORM, TOP
from infthor_sim.render.raster_numba import hits
from infthor_sim.render.shading_numba import brightness, eye_of
from infthor_sim.render.table import ORIGIN, STEPS, shading_table

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
    jagged = _find_jagged(rgb)
    us, vs = camera.rays()
    # All rays of a pixel follow each other.
    shift = SUBPIXELS * (vs[1] - vs[0] if len(vs) > 1 else 0.0)
    ray_u = (us[jagged[:, 1], None] + shift[:, 0]).ravel()
    ray_v = (vs[jagged[:, 0], None] + shift[:, 1]).ravel()
    table = shading_table(prims, projection, lights)
    first = len(projection.index)
    lists, orders, crease = _list_candidates(nearest, factors, jagged)
    found = _candidate_depths(table, first, camera.near, ray_u, ray_v, lists, orders)
    hit_orders, depths, shadow = _nearest_hits(
        lists, orders, crease, found, camera.near, camera.far
    )
    levels = np.empty(len(depths))
    brightness(
        table, first, eye_of(camera), lights.daylight, hit_orders, ray_u, ray_v, depths, levels
    )
    _blend(table, jagged, hit_orders, levels, shadow, rgb)


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
def _list_candidates(
    nearest: NDArray[np.int32], factors: Array, jagged: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int32], Array]:
    """Return the primitives that jagged pixels and their neighbours show, each once a pixel.

    Returns:
        Where each pixel's list starts, and where the last one ends (n + 1,); the primitives of all
        lists; and the crease factors of the pixels that show them.
    """
    lists = np.zeros(len(jagged) + 1, dtype=np.int64)
    orders = np.empty(len(jagged) * len(NEIGHBOURS), dtype=np.int32)
    crease = np.empty(len(orders))
    end = 0
    for index in range(len(jagged)):
        start = end
        for j in range(len(NEIGHBOURS)):
            y = jagged[index, 0] + NEIGHBOURS[j, 0]
            x = jagged[index, 1] + NEIGHBOURS[j, 1]
            if y < 0 or x < 0 or y >= nearest.shape[0] or x >= nearest.shape[1]:
                continue
            order = nearest[y, x]
            is_new = order >= 0
            for k in range(start, end):
                is_new &= orders[k] != order
            if is_new:
                orders[end] = order
                crease[end] = factors[y, x]
                end += 1
        lists[index + 1] = end
    return lists, orders[:end], crease[:end]


@njit(cache=True, error_model="numpy")
def _candidate_depths(
    table: Array,
    first: int,
    clip: float,
    ray_u: Array,
    ray_v: Array,
    lists: NDArray[np.int64],
    orders: NDArray[np.int32],
) -> Array:
    """Return the depths at which the rays of each list's pixel meet its primitives (n, parts)."""
    parts = len(SUBPIXELS)
    ray = np.empty(len(orders), dtype=np.int64)  # the first ray of each candidate's pixel
    for index in range(len(lists) - 1):
        ray[lists[index] : lists[index + 1]] = index * parts
    starts, members = group(orders, first)
    found = np.empty((len(orders), parts))
    u, v, t = np.empty(len(orders)), np.empty(len(orders)), np.empty(len(orders))
    for part in range(parts):
        for j in range(len(members)):
            i = ray[members[j]] + part
            u[j] = ray_u[i]
            v[j] = ray_v[i]
        for k in range(first):
            start = starts[k]
            end = starts[k + 1]
            if start < end:
                hits(
                    table[k, FORM], table[k, BOTTOM], table[k, TOP], table[k, ORIGIN:STEPS],
                    table[k, STEPS : STEPS + 9], u[start:end], v[start:end], clip, t[start:end],
                )  # fmt: skip
        for j in range(len(members)):
            found[members[j], part] = t[j]
    return found


@njit(cache=True, error_model="numpy")
def _nearest_hits(
    lists: NDArray[np.int64],
    orders: NDArray[np.int32],
    crease: Array,
    found: Array,
    clip: float,
    far: float,
) -> tuple[NDArray[np.int32], Array, Array]:
    """Return the primitive that each ray hits, -1 for none; at which depth; its crease factor.

    That is the factor of the pixel that showed the primitive, as there is no depth around the ray.
    """
    parts = found.shape[1]
    n = (len(lists) - 1) * parts
    hit_orders = np.full(n, -1, dtype=np.int32)
    depths, shadow = np.full(n, far), np.empty(n)
    for index in range(len(lists) - 1):
        for candidate in range(lists[index], lists[index + 1]):
            for part in range(parts):
                i = index * parts + part
                if clip < found[candidate, part] < depths[i]:
                    depths[i] = found[candidate, part]
                    hit_orders[i] = orders[candidate]
                    shadow[i] = crease[candidate]
    return hit_orders, depths, shadow


@njit(cache=True, error_model="numpy")
def _blend(
    table: Array,
    jagged: NDArray[np.int64],
    hit_orders: NDArray[np.int32],
    levels: Array,
    shadow: Array,
    rgb: NDArray[np.uint8],
) -> None:
    """Give each jagged pixel the mean colour of its rays."""
    # Each pixel reads and writes only its own colour: smoothing in place needs no copy.
    parts = len(SUBPIXELS)
    for index in range(len(jagged)):
        y, x = jagged[index, 0], jagged[index, 1]
        red = 0.0
        green = 0.0
        blue = 0.0
        for i in range(index * parts, (index + 1) * parts):
            order = hit_orders[i]
            if order < 0:  # the ray misses all candidates: the pixel's own colour is taken
                red = red + rgb[y, x, 0]
                green = green + rgb[y, x, 1]
                blue = blue + rgb[y, x, 2]
                continue
            level = levels[i] * shadow[i]
            red += min(table[order, COLOR] * level * 255.0, 255.0)
            green += min(table[order, COLOR + 1] * level * 255.0, 255.0)
            blue += min(table[order, COLOR + 2] * level * 255.0, 255.0)
        rgb[y, x, 0], rgb[y, x, 1], rgb[y, x, 2] = (
            np.uint8(red / parts),
            np.uint8(green / parts),
            np.uint8(blue / parts),
        )
