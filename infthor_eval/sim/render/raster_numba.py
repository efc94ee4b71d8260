"""The ray caster compiled by numba: for each primitive, nearest first, the pixels of its box on the screen."""

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, Projection
from infthor_eval.sim.render.primitives import BOTTOM, FORM, TOP, Form

__all__ = ["cast", "hit"]

_TINY = 1e-12
_BANDS = 8
_BOX, _ELLIPSOID, _CUP, _BOWL = int(Form.BOX), int(Form.ELLIPSOID), int(Form.CUP), int(Form.BOWL)


def cast(prims: Array, seen: Projection, camera: Camera) -> tuple[Array, NDArray[np.int32]]:
    """Depth (h, w) in metres and, per pixel, the nearest primitive's position in `seen` (h, w), -1 for none."""
    us, vs = camera.rays()
    depth = np.empty((len(vs), len(us)))
    nearest = np.empty((len(vs), len(us)), dtype=np.int32)
    profiles = prims[seen.index][:, [FORM, BOTTOM, TOP]]
    _cast(profiles, seen.origin, seen.steps, seen.box, seen.near, us, vs, camera.near, camera.far, depth, nearest)
    return depth, nearest


@njit(cache=True, inline="always")
def _steady(d: float) -> float:
    return _TINY if -_TINY < d < _TINY else d


@njit(cache=True, inline="always")
def _hit_box(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    inverse = 1.0 / _steady(dx)
    t1, t2 = (-1.0 - ox) * inverse, (1.0 - ox) * inverse
    enter, leave = min(t1, t2), max(t1, t2)
    inverse = 1.0 / _steady(dy)
    t1, t2 = (-1.0 - oy) * inverse, (1.0 - oy) * inverse
    enter, leave = max(enter, min(t1, t2)), min(leave, max(t1, t2))
    inverse = 1.0 / _steady(dz)
    t1, t2 = (-1.0 - oz) * inverse, (1.0 - oz) * inverse
    enter, leave = max(enter, min(t1, t2)), min(leave, max(t1, t2))
    return enter if enter <= leave else math.inf


@njit(cache=True, inline="always")
def _hit_sphere(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - 1.0
    disc = b * b - a * c
    return (-b - math.sqrt(disc)) / a if disc >= 0.0 else math.inf


@njit(cache=True)
def _hit_bowl(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, clip: float) -> float:
    oy, dy = (oy - 1.0) * 0.5, dy * 0.5
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - 1.0
    disc = b * b - a * c
    if disc < 0.0:
        return math.inf
    root = math.sqrt(disc)
    for sign in (-1.0, 1.0):
        t = (-b + sign * root) / a
        if t > clip and oy + t * dy <= 0.0:
            return t
    return math.inf


@njit(cache=True)
def _hit_cylinder(
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    bottom: float,
    top: float,
    is_open: bool,
    clip: float,
) -> float:
    m, k = (bottom + top) * 0.5, (top - bottom) * 0.5
    radius = m + k * oy
    a = _steady(dx * dx + dz * dz - k * k * dy * dy)
    b = ox * dx + oz * dz - k * dy * radius
    c = ox * ox + oz * oz - radius * radius
    disc = b * b - a * c
    best = math.inf
    if disc >= 0.0:
        root = math.sqrt(disc)
        for sign in (-1.0, 1.0):
            t = (-b + sign * root) / a
            y = oy + t * dy
            if -1.0 <= y <= 1.0 and m + k * y >= 0.0 and clip < t < best:
                best = t
    inverse = 1.0 / _steady(dy)
    t = (-1.0 - oy) * inverse
    x, z = ox + t * dx, oz + t * dz
    if x * x + z * z <= bottom * bottom and clip < t < best:
        best = t
    if not is_open:
        t = (1.0 - oy) * inverse
        x, z = ox + t * dx, oz + t * dz
        if x * x + z * z <= top * top and clip < t < best:
            best = t
    return best


@njit(cache=True, inline="always")
def hit(
    form: float,
    bottom: float,
    top: float,
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    clip: float,
) -> float:
    """Depth at which a ray from o along d meets a primitive, in its scaled frame; infinity where it does not."""
    if form == _BOX:
        return _hit_box(ox, oy, oz, dx, dy, dz)
    if form == _ELLIPSOID:
        return _hit_sphere(ox, oy, oz, dx, dy, dz)
    if form == _BOWL:
        return _hit_bowl(ox, oy, oz, dx, dy, dz, clip)
    return _hit_cylinder(ox, oy, oz, dx, dy, dz, bottom, top, form == _CUP, clip)


@njit(cache=True, parallel=True)
def _cast(
    profiles: Array,
    origin: Array,
    steps: Array,
    box: NDArray[np.int64],
    near: Array,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    depth: Array,
    nearest: NDArray[np.int32],
) -> None:
    height = len(vs)
    for band in prange(_BANDS):
        low, high = band * height // _BANDS, (band + 1) * height // _BANDS
        depth[low:high] = far
        nearest[low:high] = -1
        for order in range(len(profiles)):
            form, bottom, top = profiles[order, 0], profiles[order, 1], profiles[order, 2]
            ox, oy, oz = origin[order, 0], origin[order, 1], origin[order, 2]
            step = steps[order]
            for y in range(max(low, box[order, 2]), min(high, box[order, 3] + 1)):
                v = vs[y]
                for x in range(box[order, 0], box[order, 1] + 1):
                    limit = depth[y, x]
                    if limit <= near[order]:
                        continue
                    u = us[x]
                    dx = (step[0, 0] + u * step[1, 0]) + v * step[2, 0]
                    dy = (step[0, 1] + u * step[1, 1]) + v * step[2, 1]
                    dz = (step[0, 2] + u * step[1, 2]) + v * step[2, 2]
                    t = hit(form, bottom, top, ox, oy, oz, dx, dy, dz, clip)
                    if clip < t < limit:
                        depth[y, x] = t
                        nearest[y, x] = order
