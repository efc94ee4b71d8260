"""The projection of primitives for the ray caster, compiled by numba but for what numpy does well.

The tests' renderer in numpy has the same sums in the same order, hence some parentheses.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import CORNERS, EDGES, PinholeCamera, Projection
from infthor_sim.render.primitives import AXES, CENTER, HALF

# of a primitive's picture: low and high u and v, least and greatest depth
_U0, _V0, _U1, _V1, _NEAR, _FAR = range(6)


def project(prims: Array, camera: PinholeCamera) -> Projection:
    """Cull, sort and transform the primitives (n, COLUMNS) for a camera."""
    axes = prims[:, AXES : AXES + 9].reshape(-1, 3, 3)
    half = prims[:, HALF : HALF + 3]
    offset = prims[:, CENTER : CENTER + 3] - camera.position
    center = offset @ camera.matrix  # along the camera's right, up and forward
    extents = (axes * half[:, :, None]) @ camera.matrix
    bounds = np.empty((len(prims), 6))
    _measure(center, extents, camera.near, bounds)
    us, vs = camera.rays()
    first_column = np.searchsorted(us, bounds[:, _U0]) - 1
    last_column = np.searchsorted(us, bounds[:, _U1])
    first_row = np.searchsorted(vs, bounds[:, _V0]) - 1
    last_row = np.searchsorted(vs, bounds[:, _V1])
    seen = (
        (bounds[:, _FAR] > camera.near)
        & (first_column < camera.width)
        & (last_column >= 0)
        & (first_row < camera.height)
        & (last_row >= 0)
    )
    index = np.nonzero(seen)[0]
    near = bounds[index, _NEAR]
    # Nearest first, so that near primitives hide far ones before these are computed. The nearest
    # corner alone would put walls and floors, which pass under the camera, before everything; half
    # the depth of the middle corrects that. The order also breaks ties between coinciding surfaces,
    # so the sort must be stable.
    by_depth = np.argsort(np.maximum(near, center[index, 2] * 0.5), kind="stable")
    index = index[by_depth]
    box = np.stack([first_column, last_column, first_row, last_row], axis=1)[index]
    box[:, :2] = np.clip(box[:, :2], 0, camera.width - 1)
    box[:, 2:] = np.clip(box[:, 2:], 0, camera.height - 1)
    origin = np.empty((len(index), 3))
    steps = np.empty((len(index), 3, 3))
    _transform(prims, index, offset, camera.matrix, origin, steps)
    return Projection(index, origin, steps, box, near[by_depth])


@njit(cache=True, error_model="numpy")
def _measure(center: Array, extents: Array, limit: float, bounds: Array) -> None:
    """Write the bounds of boxes by their middle and half edges, cut off at the depth `limit`."""
    points = np.empty((len(CORNERS), 3))
    for n in range(len(center)):
        u0 = v0 = near = math.inf
        u1 = v1 = farthest = -math.inf
        n_in_front = 0
        for k in range(len(CORNERS)):
            for i in range(3):
                points[k, i] = center[n, i] + (
                    (CORNERS[k, 0] * extents[n, 0, i] + CORNERS[k, 1] * extents[n, 1, i])
                    + CORNERS[k, 2] * extents[n, 2, i]
                )
            depth = points[k, 2]
            near = min(near, depth)
            farthest = max(farthest, depth)
            if depth >= limit:
                n_in_front += 1
                u = points[k, 0] / depth
                v = points[k, 1] / depth
                u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        if 0 < n_in_front < len(CORNERS):
            # Corners behind the camera project to the wrong side. The points where edges cross the
            # clipping plane take their place.
            for a, b in EDGES:
                if (points[a, 2] >= limit) != (points[b, 2] >= limit):
                    share = (limit - points[a, 2]) / (points[b, 2] - points[a, 2])
                    u = (points[a, 0] + share * (points[b, 0] - points[a, 0])) / limit
                    v = (points[a, 1] + share * (points[b, 1] - points[a, 1])) / limit
                    u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        bounds[n, _U0] = u0
        bounds[n, _V0] = v0
        bounds[n, _U1] = u1
        bounds[n, _V1] = v1
        bounds[n, _NEAR] = near
        bounds[n, _FAR] = farthest


@njit(cache=True, error_model="numpy")
def _transform(
    prims: Array,
    index: NDArray[np.int64],
    offset: Array,
    matrix: Array,
    origin: Array,
    steps: Array,
) -> None:
    """Write the camera's place, and its forward, right and up, in primitives' scaled frames."""
    for n in range(len(index)):
        row = index[n]
        for i in range(3):
            half = prims[row, HALF + i]
            x = prims[row, AXES + 3 * i] / half
            y = prims[row, AXES + 3 * i + 1] / half
            z = prims[row, AXES + 3 * i + 2] / half
            origin[n, i] = -((x * offset[row, 0] + z * offset[row, 2]) + y * offset[row, 1])
            for k in range(3):
                column = (k + 2) % 3  # forward is the camera's third axis
                steps[n, k, i] = (x * matrix[0, column] + z * matrix[2, column]) + y * matrix[
                    1, column
                ]
