"""Pinhole cameras, and the projection of primitives for the ray caster.

A ray through pixel (column, row) leaves the camera along `forward + us[column] * right + vs[row] *
up`, so its parameter t is the depth along the camera's forward axis in metres. Rows count from the
bottom, as in the protocol.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.primitives import AXES, CENTER, HALF

__all__ = ["FAR", "NEAR", "PinholeCamera", "Projection", "project"]

# clipping planes of AI2-THOR's cameras, metres
NEAR = 0.1
FAR = 20.0
_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1])


@dataclass(frozen=True)
class PinholeCamera:
    """A pinhole camera.

    Attributes:
        position: position in the world, metres (3,).
        matrix: rotation (3, 3).
        field_of_view: vertical, degrees.
        width, height: size of its pictures, pixels.
        near, far: depths of the clipping planes, metres.
    """

    position: Array
    matrix: Array
    field_of_view: float
    width: int
    height: int
    near: float = NEAR
    far: float = FAR

    def rays(self) -> tuple[Array, Array]:
        """Return horizontal (width,) and vertical (height,) components of rays, bottom first.

        They are read-only, as all cameras of one lens share them.
        """
        return _rays(self.field_of_view, self.width, self.height)


@lru_cache(maxsize=8)
def _rays(field_of_view: float, width: int, height: int) -> tuple[Array, Array]:
    focal = height / 2 / math.tan(math.radians(field_of_view) / 2)
    us: Array = (np.arange(width, dtype=np.float64) + 0.5 - width / 2) / focal
    vs: Array = (np.arange(height, dtype=np.float64) + 0.5 - height / 2) / focal
    us.flags.writeable = vs.flags.writeable = False
    return us, vs


@dataclass(frozen=True)
class Projection:
    """The primitives in one camera's view, roughly nearest first.

    Attributes:
        index: row of each primitive in the scene's array (n,).
        origin: camera's position in each primitive's scaled frame (n, 3).
        steps: camera's forward, right and up vectors in each primitive's scaled frame (n, 3, 3).
        box: first and last column, first and last row of each primitive's picture, both inclusive
            (n, 4).
        near: lower bound of each primitive's depth, metres (n,).
    """

    index: NDArray[np.int64]
    origin: Array
    steps: Array
    box: NDArray[np.int64]
    near: Array


def project(prims: Array, camera: PinholeCamera) -> Projection:
    """Cull, sort and transform the primitives (n, COLUMNS) for a camera."""
    axes = prims[:, AXES : AXES + 9].reshape(-1, 3, 3)
    half = prims[:, HALF : HALF + 3]
    offset = prims[:, CENTER : CENTER + 3] - camera.position
    view = camera.matrix.T  # rows: right, up, forward
    center = offset @ view.T
    extents = (axes * half[:, :, None]) @ view.T
    points = center[:, None, :] + _SIGNS @ extents
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
    # Nearest first, so that near primitives hide far ones before these are computed. The nearest
    # corner alone would put walls and floors, which pass under the camera, before everything; half
    # the depth of the middle corrects that. The order also breaks ties between coinciding surfaces,
    # so the sort must be stable.
    index = index[np.argsort(np.maximum(near[index], center[index, 2] * 0.5), kind="stable")]
    box = np.stack([first_column, last_column, first_row, last_row], axis=1)[index]
    box[:, :2] = np.clip(box[:, :2], 0, camera.width - 1)
    box[:, 2:] = np.clip(box[:, 2:], 0, camera.height - 1)
    local = axes[index] / half[index][:, :, None]
    origin = -np.einsum("nij,nj->ni", local, offset[index])
    forward_right_up = camera.matrix[:, [2, 0, 1]].T
    steps = np.einsum("nij,kj->nki", local, forward_right_up)
    return Projection(
        index, np.ascontiguousarray(origin), np.ascontiguousarray(steps), box, near[index]
    )


def _screen_bounds(points: Array, limit: float) -> tuple[Array, Array]:
    """Return low and high (u, v) of boxes by their corners (n, 8, 3), clipped at `limit`."""
    depth = points[:, :, 2]
    front = depth >= limit
    safe = np.where(front, depth, 1.0)
    flat = points[:, :, :2] / safe[:, :, None]
    low = np.where(front[:, :, None], flat, np.inf).min(axis=1)
    high = np.where(front[:, :, None], flat, -np.inf).max(axis=1)
    # Boxes that reach behind the camera: corners there project to the wrong side. The points where
    # edges cross the clipping plane take the corners' place.
    cut = np.nonzero(front.any(axis=1) & ~front.all(axis=1))[0]
    if cut.size:
        a = points[cut][:, _EDGES[:, 0]]
        b = points[cut][:, _EDGES[:, 1]]
        crosses = (a[:, :, 2] >= limit) != (b[:, :, 2] >= limit)
        gap = np.where(crosses, b[:, :, 2] - a[:, :, 2], 1.0)
        share = (limit - a[:, :, 2]) / gap
        at = (a[:, :, :2] + share[:, :, None] * (b[:, :, :2] - a[:, :, :2])) / limit
        low[cut] = np.minimum(low[cut], np.where(crosses[:, :, None], at, np.inf).min(axis=1))
        high[cut] = np.maximum(high[cut], np.where(crosses[:, :, None], at, -np.inf).max(axis=1))
    return low, high
