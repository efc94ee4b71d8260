"""Smoothing of jagged pixels in numpy."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import COLOR
from infthor_sim.render.smoothing_numba import JUMP, NEIGHBOURS, SUBPIXELS

from .raster import hit
from .shading import brightness_at

__all__ = ["smooth"]


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
    ys, xs = _find_jagged(rgb)
    if not len(ys):
        return
    us, vs = camera.rays()
    pixel = vs[1] - vs[0] if len(vs) > 1 else 0.0
    around_y = ys[:, None] + NEIGHBOURS[:, 0]
    around_x = xs[:, None] + NEIGHBOURS[:, 1]
    inside = (
        (around_y >= 0) & (around_x >= 0) & (around_y < rgb.shape[0]) & (around_x < rgb.shape[1])
    )
    around_y = np.where(inside, around_y, ys[:, None])
    around_x = np.where(inside, around_x, xs[:, None])
    orders = np.where(inside, nearest[around_y, around_x], -1)
    total = np.zeros((len(ys), 3))
    for dx, dy in SUBPIXELS:
        u, v = us[xs] + dx * pixel, vs[ys] + dy * pixel
        depths = _depths(prims, projection, camera, orders, u, v)
        chosen = depths.argmin(axis=1)
        best = depths[np.arange(len(ys)), chosen]
        at = np.isfinite(best)
        total[~at] += rgb[ys[~at], xs[~at]]
        near_y = around_y[at, chosen[at]]
        near_x = around_x[at, chosen[at]]
        order = nearest[near_y, near_x]
        p = prims[projection.index[order]]
        level = brightness_at(
            p,
            projection.origin[order],
            projection.steps[order],
            (u[at], v[at], best[at]),
            camera,
            lights,
        )
        level = level * factors[near_y, near_x]
        total[at] += np.minimum(p[:, COLOR : COLOR + 3] * level[:, None] * 255.0, 255.0)
    rgb[ys, xs] = (total / len(SUBPIXELS)).astype(np.uint8)


def _find_jagged(rgb: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the pixels that differ much from a neighbour."""
    # int16 holds sums up to 765 and their differences, in a quarter of the memory of numpy's
    # default.
    total = np.add(rgb[:, :, 0], rgb[:, :, 1], dtype=np.int16)
    total += rgb[:, :, 2]
    marked = np.zeros(total.shape, dtype=bool)
    down = np.abs(total[1:] - total[:-1]) > JUMP
    across = np.abs(total[:, 1:] - total[:, :-1]) > JUMP
    marked[1:] |= down
    marked[:-1] |= down
    marked[:, 1:] |= across
    marked[:, :-1] |= across
    ys, xs = np.nonzero(marked)
    return ys, xs


def _depths(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    orders: NDArray[np.int32],
    u: Array,
    v: Array,
) -> Array:
    """Return depths of candidates (n, m) on the rays (u, v) (n,); infinity for misses."""
    depths = np.full(orders.shape, np.inf)
    for order in np.unique(orders[orders >= 0]):
        rows, columns = np.nonzero(orders == order)
        t = hit(prims, projection, order, (u[rows], v[rows]), camera.near)
        depths[rows, columns] = np.where((t > camera.near) & (t < camera.far), t, np.inf)
    return depths
