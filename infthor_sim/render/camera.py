"""Pinhole cameras, and what the projection of primitives for the ray caster has.

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

# clipping planes of AI2-THOR's cameras, metres
NEAR = 0.1
FAR = 20.0
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
"""Corners of a box, in half extents."""
EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1])


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

    def ray_grid(self) -> tuple[Array, Array]:
        """Return both components of each pixel's ray (height * width,), row by row.

        All cameras of one lens share the arrays: they must stay as they are.
        """
        return _ray_grid(self.field_of_view, self.width, self.height)


@lru_cache(maxsize=8)
def _rays(field_of_view: float, width: int, height: int) -> tuple[Array, Array]:
    focal = height / 2 / math.tan(math.radians(field_of_view) / 2)
    us: Array = (np.arange(width, dtype=np.float64) + 0.5 - width / 2) / focal
    vs: Array = (np.arange(height, dtype=np.float64) + 0.5 - height / 2) / focal
    us.flags.writeable = vs.flags.writeable = False
    return us, vs


@lru_cache(maxsize=2)
def _ray_grid(field_of_view: float, width: int, height: int) -> tuple[Array, Array]:
    us, vs = _rays(field_of_view, width, height)
    # Not marked read-only, as kernels would be compiled anew for such arrays.
    return np.tile(us, height), np.repeat(vs, width)


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
