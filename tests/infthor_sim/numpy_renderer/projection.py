"""The projection of `projection_numba`, which has the comments, in numpy."""

import numpy as np

from infthor_sim.geometry import Array
from infthor_sim.render.camera import CORNERS, EDGES, PinholeCamera, Projection
from infthor_sim.render.primitives import AXES, CENTER, HALF

__all__ = ["project"]


def project(prims: Array, camera: PinholeCamera) -> Projection:
    """Cull, sort and transform the primitives (n, COLUMNS) for a camera."""
    axes = prims[:, AXES : AXES + 9].reshape(-1, 3, 3)
    half = prims[:, HALF : HALF + 3]
    offset = prims[:, CENTER : CENTER + 3] - camera.position
    center = offset @ camera.matrix
    extents = (axes * half[:, :, None]) @ camera.matrix
    points = center[:, None, :] + CORNERS @ extents
    low, high = _screen_bounds(points, camera.near)
    us, vs = camera.rays()
    first_column = np.searchsorted(us, low[:, 0]) - 1
    last_column = np.searchsorted(us, high[:, 0])
    first_row = np.searchsorted(vs, low[:, 1]) - 1
    last_row = np.searchsorted(vs, high[:, 1])
    near = points[:, :, 2].min(axis=1)
    seen = (
        (points[:, :, 2].max(axis=1) > camera.near)
        & (first_column < camera.width)
        & (last_column >= 0)
        & (first_row < camera.height)
        & (last_row >= 0)
    )
    index = np.nonzero(seen)[0]
    index = index[np.argsort(np.maximum(near[index], center[index, 2] * 0.5), kind="stable")]
    box = np.stack([first_column, last_column, first_row, last_row], axis=1)[index]
    box[:, :2] = np.clip(box[:, :2], 0, camera.width - 1)
    box[:, 2:] = np.clip(box[:, 2:], 0, camera.height - 1)
    local = axes[index] / half[index][:, :, None]
    origin = -_dot(local, offset[index][:, None])
    steps = np.stack([_dot(local, camera.matrix[:, k]) for k in (2, 0, 1)], axis=1)
    return Projection(index, origin, steps, box, near[index])


def _dot(a: Array, b: Array) -> Array:
    return (a[..., 0] * b[..., 0] + a[..., 2] * b[..., 2]) + a[..., 1] * b[..., 1]


def _screen_bounds(points: Array, limit: float) -> tuple[Array, Array]:
    """Return low and high (u, v) of boxes by their corners (n, 8, 3), clipped at `limit`."""
    depth = points[:, :, 2]
    front = depth >= limit
    safe = np.where(front, depth, 1.0)
    flat = points[:, :, :2] / safe[:, :, None]
    low = np.where(front[:, :, None], flat, np.inf).min(axis=1)
    high = np.where(front[:, :, None], flat, -np.inf).max(axis=1)
    cut = np.nonzero(front.any(axis=1) & ~front.all(axis=1))[0]
    if cut.size:
        a = points[cut][:, EDGES[:, 0]]
        b = points[cut][:, EDGES[:, 1]]
        crosses = (a[:, :, 2] >= limit) != (b[:, :, 2] >= limit)
        gap = np.where(crosses, b[:, :, 2] - a[:, :, 2], 1.0)
        share = (limit - a[:, :, 2]) / gap
        at = (a[:, :, :2] + share[:, :, None] * (b[:, :, :2] - a[:, :, :2])) / limit
        low[cut] = np.minimum(low[cut], np.where(crosses[:, :, None], at, np.inf).min(axis=1))
        high[cut] = np.maximum(high[cut], np.where(crosses[:, :, None], at, -np.inf).max(axis=1))
    return low, high
