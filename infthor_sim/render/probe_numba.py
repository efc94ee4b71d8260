"""Whether an object is visible in many directions, compiled by numba: it stops at enough pixels.

The sums are those of `projection_numba`, but of one primitive at a time: what cannot be in front of
the object is left out before it is transformed.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.primitives import AXES, BOTTOM, CENTER, FORM, HALF, TOP
from infthor_sim.render.raster_numba import hit

# every eighth row and column is tried first: an object in full view shows up there already
_COARSE = 8
# of a primitive in a camera's view: first and last column, first and last row, least and greatest
# depth, and its place in the order of the ray caster
_X0, _X1, _Y0, _Y1, _NEAR, _FAR, _KEY = range(7)


def sees(
    prims: Array,
    own: NDArray[np.bool_],
    camera: PinholeCamera,
    matrices: Array,
    min_pixels: int,
) -> NDArray[np.bool_]:
    """Return in which directions at least `min_pixels` pixels show a primitive marked in `own`.

    Args:
        prims: the primitives (n, COLUMNS).
        own: marks of those to look for (n,).
        camera: place and lens; its own direction does not count.
        matrices: directions as rotations (m, 3, 3).
    """
    us, vs = camera.rays()
    seen = np.zeros(len(matrices), dtype=np.bool_)
    _sees(
        prims, np.nonzero(own)[0], np.nonzero(~own)[0], camera.position, matrices, us, vs,
        camera.near, camera.far, min_pixels, seen,
    )  # fmt: skip
    return seen


@njit(cache=True, error_model="numpy")
def _sees(
    prims: Array,
    own: NDArray[np.int64],
    others: NDArray[np.int64],
    eye: Array,
    matrices: Array,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    min_pixels: int,
    seen: NDArray[np.bool_],
) -> None:
    count = len(prims)
    offset = np.empty((count, 3))
    extent = np.empty((count, 3, 3))
    local = np.empty((count, 3, 3))
    origin = np.empty((count, 3))
    for k in range(count):
        for j in range(3):
            offset[k, j] = prims[k, CENTER + j] - eye[j]
        for i in range(3):
            half = prims[k, HALF + i]
            total = 0.0
            for j in range(3):
                axis = prims[k, AXES + 3 * i + j]
                extent[k, i, j] = axis * half
                local[k, i, j] = axis / half
                total += local[k, i, j] * offset[k, j]
            origin[k, i] = -total
    view = np.empty((count, 7))
    steps = np.empty((count, 3, 3))
    found = np.empty(len(own), dtype=np.int64)
    near = np.empty(len(others), dtype=np.int64)
    for m in range(len(matrices)):
        matrix = matrices[m]
        frame = np.array([np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf])
        own_count = 0
        for k in own:
            if _project(offset[k], extent[k], matrix, us, vs, clip, view[k]):
                frame[_X0] = min(frame[_X0], view[k, _X0])
                frame[_X1] = max(frame[_X1], view[k, _X1])
                frame[_Y0] = min(frame[_Y0], view[k, _Y0])
                frame[_Y1] = max(frame[_Y1], view[k, _Y1])
                frame[_FAR] = max(frame[_FAR], view[k, _FAR])
                _turn(local[k], matrix, steps[k])
                found[own_count] = k
                own_count += 1
        if own_count == 0:
            continue
        other_count = 0
        for k in others:
            if (
                _project(offset[k], extent[k], matrix, us, vs, clip, view[k])
                and view[k, _NEAR] <= frame[_FAR]
                and view[k, _X0] <= frame[_X1]
                and view[k, _X1] >= frame[_X0]
                and view[k, _Y0] <= frame[_Y1]
                and view[k, _Y1] >= frame[_Y0]
            ):
                _turn(local[k], matrix, steps[k])
                near[other_count] = k
                other_count += 1
        seen[m] = _shows(
            prims, origin, steps, view, frame, us, vs, clip, far,
            found[:own_count], near[:other_count], min_pixels,
        )  # fmt: skip


@njit(cache=True, error_model="numpy", inline="always")
def _turn(local: Array, matrix: Array, steps: Array) -> None:
    """Write a camera's forward, right and up vectors in a primitive's scaled frame (3, 3)."""
    for row, column in enumerate((2, 0, 1)):
        for i in range(3):
            steps[row, i] = (
                local[i, 0] * matrix[0, column] + local[i, 1] * matrix[1, column]
            ) + local[i, 2] * matrix[2, column]


@njit(cache=True, error_model="numpy")
def _project(
    offset: Array, extent: Array, matrix: Array, us: Array, vs: Array, clip: float, view: Array
) -> bool:
    """Write where a primitive is in the picture to `view` (7,); return whether it is in it."""
    center = np.empty(3)
    edge = np.empty((3, 3))
    for c in range(3):
        center[c] = (offset[0] * matrix[0, c] + offset[1] * matrix[1, c]) + offset[2] * matrix[2, c]
        for i in range(3):
            edge[i, c] = (extent[i, 0] * matrix[0, c] + extent[i, 1] * matrix[1, c]) + extent[
                i, 2
            ] * matrix[2, c]
    deep = (abs(edge[0, 2]) + abs(edge[1, 2])) + abs(edge[2, 2])
    if center[2] + deep <= clip:
        return False
    points = np.empty((8, 3))
    low_u = low_v = nearest = np.inf
    high_u = high_v = farthest = -np.inf
    for corner in range(8):
        a = 1.0 if corner & 4 else -1.0
        b = 1.0 if corner & 2 else -1.0
        d = 1.0 if corner & 1 else -1.0
        for c in range(3):
            points[corner, c] = center[c] + ((a * edge[0, c] + b * edge[1, c]) + d * edge[2, c])
        depth = points[corner, 2]
        nearest = min(nearest, depth)
        farthest = max(farthest, depth)
        if depth >= clip:
            u = points[corner, 0] / depth
            v = points[corner, 1] / depth
            low_u, high_u = min(low_u, u), max(high_u, u)
            low_v, high_v = min(low_v, v), max(high_v, v)
    if farthest <= clip:
        return False
    if nearest < clip:  # the points where edges cross the clipping plane
        for corner in range(8):
            for bit in (1, 2, 4):
                other = corner ^ bit
                za, zb = points[corner, 2], points[other, 2]
                if za < clip <= zb:
                    share = (clip - za) / (zb - za)
                    u = (points[corner, 0] + share * (points[other, 0] - points[corner, 0])) / clip
                    v = (points[corner, 1] + share * (points[other, 1] - points[corner, 1])) / clip
                    low_u, high_u = min(low_u, u), max(high_u, u)
                    low_v, high_v = min(low_v, v), max(high_v, v)
    # One pixel wider on both sides, so that rounding leaves nothing out.
    x0, x1 = _pixel(us, low_u) - 1, _pixel(us, high_u) + 1
    y0, y1 = _pixel(vs, low_v) - 1, _pixel(vs, high_v) + 1
    if x0 >= len(us) or x1 < 0 or y0 >= len(vs) or y1 < 0:
        return False
    view[_X0], view[_X1] = max(x0, 0), min(x1, len(us) - 1)
    view[_Y0], view[_Y1] = max(y0, 0), min(y1, len(vs) - 1)
    view[_NEAR], view[_FAR] = nearest, farthest
    view[_KEY] = max(nearest, center[2] * 0.5)
    return True


@njit(cache=True, error_model="numpy", inline="always")
def _pixel(rays: Array, at: float) -> int:
    """Return the pixel of a row or column of evenly spaced rays; beyond the ends, next to them."""
    spacing = 2.0 * abs(rays[0]) / (len(rays) - 1) if len(rays) > 1 else 1.0
    place = (at - rays[0]) / spacing
    return math.floor(min(max(place, -3.0), len(rays) + 3.0))


@njit(cache=True, error_model="numpy", inline="always")
def _depth(
    prims: Array, origin: Array, steps: Array, k: int, u: float, v: float, clip: float
) -> float:
    o = origin[k]
    step = steps[k]
    dx = (step[0, 0] + u * step[1, 0]) + v * step[2, 0]
    dy = (step[0, 1] + u * step[1, 1]) + v * step[2, 1]
    dz = (step[0, 2] + u * step[1, 2]) + v * step[2, 2]
    form, bottom, top = prims[k, FORM], prims[k, BOTTOM], prims[k, TOP]
    return hit(form, bottom, top, o[0], o[1], o[2], dx, dy, dz, clip)


@njit(cache=True, error_model="numpy", inline="always")
def _covers(view: Array, k: int, x: int, y: int) -> bool:
    return view[k, _X0] <= x <= view[k, _X1] and view[k, _Y0] <= y <= view[k, _Y1]


@njit(cache=True, error_model="numpy", inline="always")
def _is_before(view: Array, k: int, first: int) -> bool:
    """Return whether the ray caster tries one primitive before another: it wins a tie."""
    return view[k, _KEY] < view[first, _KEY] or (view[k, _KEY] == view[first, _KEY] and k < first)


@njit(cache=True, error_model="numpy")
def _shows(
    prims: Array,
    origin: Array,
    steps: Array,
    view: Array,
    frame: Array,
    us: Array,
    vs: Array,
    clip: float,
    far: float,
    own: NDArray[np.int64],
    others: NDArray[np.int64],
    min_pixels: int,
) -> bool:
    hider = -1  # what hid the last pixel is tried first, as it mostly hides the next one too
    for every in (_COARSE, 1):
        count = 0  # the fine pass counts all pixels afresh, those of the coarse one among them
        for y in range(int(frame[_Y0]) + every // 2, int(frame[_Y1]) + 1, every):
            for x in range(int(frame[_X0]) + every // 2, int(frame[_X1]) + 1, every):
                u, v = us[x], vs[y]
                # of the object's own nearest primitive
                depth = far
                first = -1
                for k in own:
                    if _covers(view, k, x, y) and view[k, _NEAR] <= depth:
                        t = _depth(prims, origin, steps, k, u, v, clip)
                        if clip < t and (
                            t < depth or (t == depth and first >= 0 and _is_before(view, k, first))
                        ):
                            depth = t
                            first = k
                if first < 0:
                    continue
                hidden = False
                for n in range(-1, len(others)):
                    k = others[n] if n >= 0 else hider
                    if k >= 0 and _covers(view, k, x, y) and view[k, _NEAR] <= depth:
                        t = _depth(prims, origin, steps, k, u, v, clip)
                        # Ties go to the earlier primitive, as in the ray caster, with whose picture
                        # this must agree.
                        if t > clip and (t < depth or (t == depth and _is_before(view, k, first))):
                            hider = k
                            hidden = True
                            break
                count += 0 if hidden else 1
                if count >= min_pixels:
                    return True
    return False
