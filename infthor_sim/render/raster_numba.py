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


def count_pixels(nearest: NDArray[np.int32], n_primitives: int) -> NDArray[np.int64]:
    """Return how many pixels show each primitive in `projection` (n_primitives,)."""
    counts = np.zeros(n_primitives + 1, dtype=np.int64)
    _count(nearest.ravel(), counts)
    return counts[1:]


@njit(cache=True, error_model="numpy")
def _count(nearest: NDArray[np.int32], counts: NDArray[np.int64]) -> None:
    """Add the pixels of each primitive to `counts`, those of none, -1, to its first entry."""
    # Neighbours mostly show the same, so that runs are counted and not pixels.
    first = 0
    for i in range(1, len(nearest)):
        if nearest[i] != nearest[first]:
            counts[nearest[first] + 1] += i - first
            first = i
    counts[nearest[first] + 1] += len(nearest) - first


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
def hits(
    form: float,
    bottom: float,
    top: float,
    origin: Array,
    steps: Array,
    us: Array,
    vs: Array,
    clip: float,
    ts: Array,
) -> None:
    """Write the depths at which rays (us, vs) meet one primitive to `ts`, see `hit`."""
    ox, oy, oz = origin[0], origin[1], origin[2]
    ahead_x, ahead_y, ahead_z = steps[0], steps[1], steps[2]
    right_x, right_y, right_z = steps[3], steps[4], steps[5]
    up_x, up_y, up_z = steps[6], steps[7], steps[8]
    if form == _BOX:  # a loop of its own, which the compiler turns into one over several rays
        for i in range(len(us)):
            dx = (ahead_x + us[i] * right_x) + vs[i] * up_x
            dy = (ahead_y + us[i] * right_y) + vs[i] * up_y
            dz = (ahead_z + us[i] * right_z) + vs[i] * up_z
            ts[i] = _hit_box(ox, oy, oz, dx, dy, dz)
        return
    for i in range(len(us)):
        dx = (ahead_x + us[i] * right_x) + vs[i] * up_x
        dy = (ahead_y + us[i] * right_y) + vs[i] * up_y
        dz = (ahead_z + us[i] * right_z) + vs[i] * up_z
        ts[i] = hit(form, bottom, top, ox, oy, oz, dx, dy, dz, clip)


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
        for y in range(box[order, 2], box[order, 3] + 1):
            first = box[order, 0]
            last = box[order, 1]
            # The ends of the row that are hidden for sure, as those of most far primitives are.
            while first <= last and depth[y, first] <= near[order]:
                first += 1
            while first < last and depth[y, last] <= near[order]:
                last -= 1
            if first > last:
                continue
            us_there = us[first : last + 1]
            depth_there = depth[y, first : last + 1]
            nearest_there = nearest[y, first : last + 1]
            if profiles[order, 0] == _BOX:
                _cast_box_row(
                    origin[order], steps[order], near[order], us_there, vs[y], clip, order,
                    depth_there, nearest_there,
                )  # fmt: skip
            else:
                _cast_round_row(
                    profiles[order], origin[order], steps[order], near[order], us_there, vs[y],
                    clip, order, depth_there, nearest_there,
                )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _cast_box_row(
    origin: Array,
    step: Array,
    closest: float,
    us: Array,
    v: float,
    clip: float,
    order: int,
    depth: Array,
    nearest: NDArray[np.int32],
) -> None:
    # No branch depends on a pixel, so that the compiler computes several pixels at once. The
    # numbers of the primitive are taken out of their arrays first, for the same reason. What is
    # hidden for sure stays hidden, though rounding may bring a coinciding surface nearer.
    ox, oy, oz = origin[0], origin[1], origin[2]
    forward_x, forward_y, forward_z = step[0, 0], step[0, 1], step[0, 2]
    right_x, right_y, right_z = step[1, 0], step[1, 1], step[1, 2]
    up_x, up_y, up_z = v * step[2, 0], v * step[2, 1], v * step[2, 2]
    number = np.int32(order)
    if right_y == 0.0:  # an upright box before a level camera: all rays of the row rise alike
        dy = forward_y + up_y
        for x in range(len(us)):
            dx = (forward_x + us[x] * right_x) + up_x
            dz = (forward_z + us[x] * right_z) + up_z
            t = _hit_box(ox, oy, oz, dx, dy, dz)
            is_nearer = (clip < t) & (t < depth[x]) & (closest < depth[x])
            depth[x] = t if is_nearer else depth[x]
            nearest[x] = number if is_nearer else nearest[x]
        return
    for x in range(len(us)):
        dx = (forward_x + us[x] * right_x) + up_x
        dy = (forward_y + us[x] * right_y) + up_y
        dz = (forward_z + us[x] * right_z) + up_z
        t = _hit_box(ox, oy, oz, dx, dy, dz)
        is_nearer = (clip < t) & (t < depth[x]) & (closest < depth[x])
        depth[x] = t if is_nearer else depth[x]
        nearest[x] = number if is_nearer else nearest[x]


@njit(cache=True, error_model="numpy")
def _cast_round_row(
    profile: Array,
    origin: Array,
    step: Array,
    closest: float,
    us: Array,
    v: float,
    clip: float,
    order: int,
    depth: Array,
    nearest: NDArray[np.int32],
) -> None:
    form, bottom, top = profile[0], profile[1], profile[2]
    ox, oy, oz = origin[0], origin[1], origin[2]
    for x in range(len(us)):
        if depth[x] <= closest:  # hidden for sure
            continue
        dx = (step[0, 0] + us[x] * step[1, 0]) + v * step[2, 0]
        dy = (step[0, 1] + us[x] * step[1, 1]) + v * step[2, 1]
        dz = (step[0, 2] + us[x] * step[1, 2]) + v * step[2, 2]
        t = hit(form, bottom, top, ox, oy, oz, dx, dy, dz, clip)
        # Strictly nearer: where surfaces coincide the earlier primitive stays.
        if clip < t < depth[x]:
            depth[x] = t
            nearest[x] = order
