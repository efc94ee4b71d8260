"""The ray caster of `raster_numba`, which has the comments, in numpy."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.primitives import BOTTOM, FORM, TOP, Form

__all__ = ["cast", "count_pixels", "hit"]

_TINY = 1e-12


def cast(
    prims: Array, projection: Projection, camera: PinholeCamera
) -> tuple[Array, NDArray[np.int32]]:
    """Return depth (h, w), metres, and each pixel's nearest primitive in `projection`, or -1."""
    us, vs = camera.rays()
    depth = np.full((len(vs), len(us)), camera.far)
    nearest = np.full((len(vs), len(us)), -1, dtype=np.int32)
    for order, box in enumerate(projection.box):
        x0 = box[0]
        x1 = box[1] + 1
        y0 = box[2]
        y1 = box[3] + 1
        u, v = us[None, x0:x1], vs[y0:y1, None]
        t = hit(prims, projection, order, (u, v), camera.near)
        window = depth[y0:y1, x0:x1]
        closer = (t > camera.near) & (t < window)
        window[closer] = t[closer]
        nearest[y0:y1, x0:x1][closer] = order
    return depth, nearest


def count_pixels(nearest: NDArray[np.int32], n_primitives: int) -> NDArray[np.int64]:
    """Return how many pixels show each primitive (n_primitives,)."""
    return np.bincount(nearest.ravel() + 1, minlength=n_primitives + 1)[1:]


def hit(
    prims: Array, projection: Projection, order: int, rays: tuple[Array, Array], near: float
) -> Array:
    """Return the depths at which rays (u, v) meet primitive `order`; infinity for misses."""
    prim = prims[projection.index[order]]
    o = projection.origin[order]
    steps = projection.steps[order]
    u, v = rays
    d = [(steps[0, i] + u * steps[1, i]) + v * steps[2, i] for i in range(3)]
    form = prim[FORM]
    if form == Form.BOX:
        return _hit_box(o, d)
    if form == Form.ELLIPSOID:
        return _hit_sphere(o, d)
    if form == Form.BOWL:
        return _hit_bowl(o, d, near)
    return _hit_cylinder(o, d, prim[BOTTOM], prim[TOP], form == Form.CUP, near)


def _nonzero(d: Array) -> Array:
    return np.where((d > -_TINY) & (d < _TINY), _TINY, d)


def _hit_box(o: Array, d: list[Array]) -> Array:
    enter: Array = np.array(-np.inf)
    leave: Array = np.array(np.inf)
    for i in range(3):
        inverse = 1.0 / _nonzero(d[i])
        t1 = (-1.0 - o[i]) * inverse
        t2 = (1.0 - o[i]) * inverse
        enter = np.maximum(enter, np.minimum(t1, t2))
        leave = np.minimum(leave, np.maximum(t1, t2))
    return np.where(enter <= leave, enter, np.inf)


def _hit_sphere(o: Array, d: list[Array]) -> Array:
    a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
    c = o[0] * o[0] + o[1] * o[1] + o[2] * o[2] - 1.0
    disc = b * b - a * c
    root = np.sqrt(np.maximum(disc, 0.0))
    return np.where(disc >= 0.0, (-b - root) / a, np.inf)


def _hit_bowl(o: Array, d: list[Array], near: float) -> Array:
    oy = (o[1] - 1.0) * 0.5
    dy = d[1] * 0.5
    a = d[0] * d[0] + dy * dy + d[2] * d[2]
    b = o[0] * d[0] + oy * dy + o[2] * d[2]
    c = o[0] * o[0] + oy * oy + o[2] * o[2] - 1.0
    disc = b * b - a * c
    root = np.sqrt(np.maximum(disc, 0.0))
    best = np.full(disc.shape, np.inf)
    for sign in (1.0, -1.0):  # the nearer one last, so that it replaces the other
        t = (-b + sign * root) / a
        best = np.where((disc >= 0.0) & (t > near) & (oy + t * dy <= 0.0), t, best)
    return best


def _hit_cylinder(
    o: Array, d: list[Array], bottom: float, top: float, is_open: bool, near: float
) -> Array:
    m = (bottom + top) * 0.5
    k = (top - bottom) * 0.5
    radius = m + k * o[1]
    a = _nonzero(d[0] * d[0] + d[2] * d[2] - k * k * d[1] * d[1])
    b = o[0] * d[0] + o[2] * d[2] - k * d[1] * radius
    c = o[0] * o[0] + o[2] * o[2] - radius * radius
    disc = b * b - a * c
    root = np.sqrt(np.maximum(disc, 0.0))
    best = np.full(disc.shape, np.inf)
    for sign in (-1.0, 1.0):
        t = (-b + sign * root) / a
        y = o[1] + t * d[1]
        good = (
            (disc >= 0.0) & (y >= -1.0) & (y <= 1.0) & (m + k * y >= 0.0) & (t > near) & (t < best)
        )
        best = np.where(good, t, best)
    inverse = 1.0 / _nonzero(d[1])
    for y, limit in ((-1.0, bottom), (1.0, top)):
        if is_open and y > 0:
            continue
        t = (y - o[1]) * inverse
        x, z = o[0] + t * d[0], o[2] + t * d[2]
        good = (x * x + z * z <= limit * limit) & (t > near) & (t < best)
        best = np.where(good, t, best)
    return best
