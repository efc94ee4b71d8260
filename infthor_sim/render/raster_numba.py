"""The ray caster, compiled by numba: for each primitive the pixels of its box on the screen.

The nearest primitive comes first. The tests' renderer in numpy computes the same picture to the
last bit. So all numbers are float64, sums are in the same order (hence some parentheses), and
numba's `fastmath`, which would reorder them, stays off.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.primitives import BOTTOM, FORM, TOP, Form

__all__ = ["cast", "hit"]

_TINY = 1e-12  # takes the place of smaller components of directions, which are divided by
_BOX = int(Form.BOX)
_ELLIPSOID = int(Form.ELLIPSOID)
_CUP = int(Form.CUP)
_BOWL = int(Form.BOWL)


def cast(
    prims: Array, projection: Projection, camera: PinholeCamera
) -> tuple[Array, NDArray[np.int32]]:
    """Return depth (h, w), metres, and each pixel's nearest primitive in `projection`, or -1."""
    us, vs = camera.rays()
    depth = np.empty((len(vs), len(us)))
    nearest = np.empty((len(vs), len(us)), dtype=np.int32)
    profiles = prims[projection.index][:, [FORM, BOTTOM, TOP]]
    _cast(
        profiles, projection.origin, projection.steps, projection.box, projection.near, us, vs,
        camera.near, camera.far,
        depth, nearest,
    )  # fmt: skip
    return depth, nearest


@njit(cache=True, error_model="numpy", inline="always")
def _nonzero(d: float) -> float:
    return _TINY if -_TINY < d < _TINY else d


@njit(cache=True, error_model="numpy", inline="always")
def _hit_box(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    # Slab method: the ray is inside the box where it is between all three pairs of faces.
    inverse = 1.0 / _nonzero(dx)
    t1 = (-1.0 - ox) * inverse
    t2 = (1.0 - ox) * inverse
    enter = min(t1, t2)
    leave = max(t1, t2)
    inverse = 1.0 / _nonzero(dy)
    t1 = (-1.0 - oy) * inverse
    t2 = (1.0 - oy) * inverse
    enter = max(enter, min(t1, t2))
    leave = min(leave, max(t1, t2))
    inverse = 1.0 / _nonzero(dz)
    t1 = (-1.0 - oz) * inverse
    t2 = (1.0 - oz) * inverse
    enter = max(enter, min(t1, t2))
    leave = min(leave, max(t1, t2))
    return enter if enter <= leave else math.inf


@njit(cache=True, error_model="numpy", inline="always")
def _hit_sphere(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> float:
    a = dx * dx + dy * dy + dz * dz
    b = ox * dx + oy * dy + oz * dz
    c = ox * ox + oy * oy + oz * oz - 1.0
    disc = b * b - a * c
    return (-b - math.sqrt(disc)) / a if disc >= 0.0 else math.inf


@njit(cache=True, error_model="numpy")
def _hit_bowl(
    ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, clip: float
) -> float:
    # In this frame a bowl is the lower half of the unit sphere. Where the near side is cut off the
    # far side counts, as one sees the inside through the opening.
    oy = (oy - 1.0) * 0.5
    dy = dy * 0.5
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


@njit(cache=True, error_model="numpy")
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
    # The side is x^2 + z^2 = (m + k * y)^2, of which m + k * y >= 0 excludes the mirrored cone
    # beyond the apex.
    m = (bottom + top) * 0.5
    k = (top - bottom) * 0.5
    radius = m + k * oy
    a = _nonzero(dx * dx + dz * dz - k * k * dy * dy)
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
    inverse = 1.0 / _nonzero(dy)
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


@njit(cache=True, error_model="numpy", inline="always")
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
    """Return the depth at which a ray from o along d meets a primitive (scaled frame), or inf."""
    if form == _BOX:
        return _hit_box(ox, oy, oz, dx, dy, dz)
    if form == _ELLIPSOID:
        return _hit_sphere(ox, oy, oz, dx, dy, dz)
    if form == _BOWL:
        return _hit_bowl(ox, oy, oz, dx, dy, dz, clip)
    return _hit_cylinder(ox, oy, oz, dx, dy, dz, bottom, top, form == _CUP, clip)


@njit(cache=True, error_model="numpy")
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
    depth[:] = far
    nearest[:] = -1
    for order in range(len(profiles)):
        form = profiles[order, 0]
        bottom = profiles[order, 1]
        top = profiles[order, 2]
        ox = origin[order, 0]
        oy = origin[order, 1]
        oz = origin[order, 2]
        step = steps[order]
        closest = near[order]
        for y in range(box[order, 2], box[order, 3] + 1):
            v = vs[y]
            for x in range(box[order, 0], box[order, 1] + 1):
                limit = depth[y, x]
                if limit <= closest:  # hidden for sure, as most pixels of far primitives are
                    continue
                u = us[x]
                dx = (step[0, 0] + u * step[1, 0]) + v * step[2, 0]
                dy = (step[0, 1] + u * step[1, 1]) + v * step[2, 1]
                dz = (step[0, 2] + u * step[1, 2]) + v * step[2, 2]
                t = hit(form, bottom, top, ox, oy, oz, dx, dy, dz, clip)
                # Strictly nearer: where surfaces coincide the earlier primitive stays.
                if clip < t < limit:
                    depth[y, x] = t
                    nearest[y, x] = order
