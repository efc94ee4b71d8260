"""Pictures from a camera: colours, depth, and the object that each pixel shows."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.kernel_cache import drop_stale_kernels
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import INSTANCE

Project = Callable[[Array, PinholeCamera], Projection]
Cast = Callable[[Array, Projection, PinholeCamera], tuple[Array, NDArray[np.int32]]]
Count = Callable[[NDArray[np.int32], int], NDArray[np.int64]]
Pixels = NDArray[np.uint8]
Creases = Callable[[Array], Array]
Shade = Callable[
    [Array, Projection, PinholeCamera, Array, NDArray[np.int32], Array, Lights], Pixels
]
Sees = Callable[[Array, NDArray[np.bool_], PinholeCamera, Array, int], NDArray[np.bool_]]
Smooth = Callable[
    [Array, Projection, PinholeCamera, NDArray[np.int32], Array, Lights, Pixels], None
]


@dataclass(frozen=True)
class Rasterizer:
    """The renderer's functions: compiled ones, or those in numpy that tests hold them to.

    Attributes:
        project: function that culls, sorts and transforms primitives for a camera.
        cast: function that returns depth and nearest primitive of each pixel.
        count: function that returns how many pixels show each of so many primitives.
        creases: function that returns factors of brightness from the depth.
        shade: function that returns the colours of cast pixels.
        smooth: function that smooths jagged pixels of an RGB picture in place.
        sees: function that returns in which directions of a camera enough pixels show some of the
            primitives.
    """

    project: Project
    cast: Cast
    count: Count
    creases: Creases
    shade: Shade
    smooth: Smooth
    sees: Sees


@dataclass(frozen=True)
class Picture:
    """What a camera sees, bottom row first.

    Attributes:
        camera: the camera.
        prims: the primitives (n, COLUMNS).
        projection: the primitives in the camera's view.
        nearest: nearest primitive by order in `projection`, -1 for nothing (h, w).
        depth: metres along the camera's forward axis (h, w).
        names: ids of objects, and names of the parts of the shell.
    """

    camera: PinholeCamera
    prims: Array
    projection: Projection
    nearest: NDArray[np.int32]
    depth: Array
    names: tuple[str, ...]

    @cached_property
    def instances(self) -> NDArray[np.int32]:
        """Index into `names` of what each pixel shows, -1 for nothing (h, w)."""
        lookup = np.append(self.prims[self.projection.index, INSTANCE], -1).astype(np.int32)
        shown: NDArray[np.int32] = lookup[self.nearest]  # -1, nothing, takes the last entry
        return shown


def compiled_rasterizer() -> Rasterizer:
    """Return the rasterizer compiled by numba."""
    drop_stale_kernels()  # before the imports, which load cached kernels
    from infthor_sim.render.creases_numba import crease_factors
    from infthor_sim.render.probe_numba import sees
    from infthor_sim.render.projection_numba import project
    from infthor_sim.render.raster_numba import cast, count_pixels
    from infthor_sim.render.shading_numba import shade
    from infthor_sim.render.smoothing_numba import smooth

    return Rasterizer(project, cast, count_pixels, crease_factors, shade, smooth, sees)


def cast_picture(
    prims: Array,
    names: tuple[str, ...],
    camera: PinholeCamera,
    rasterizer: Rasterizer,
    base: Picture | None = None,
) -> Picture:
    """Return the picture of some primitives.

    Args:
        prims: the primitives (n, COLUMNS).
        names: ids of objects and names of the parts of the shell, by instance.
        base: picture of the same camera to draw over; its pixels that are nearer stay. None for an
            empty one.
    """
    projection = rasterizer.project(prims, camera)
    depth, nearest = rasterizer.cast(prims, projection, camera)
    if base is None:
        return Picture(camera, prims, projection, nearest, depth, names)
    return _drawn_over(base, Picture(camera, prims, projection, nearest, depth, names))


def _drawn_over(base: Picture, top: Picture) -> Picture:
    """Return two pictures of one camera as one; names are those of the upper one."""
    merged = Projection(
        np.append(base.projection.index, top.projection.index + len(base.prims)),
        np.concatenate([base.projection.origin, top.projection.origin]),
        np.concatenate([base.projection.steps, top.projection.steps]),
        np.concatenate([base.projection.box, top.projection.box]),
        np.append(base.projection.near, top.projection.near),
    )
    nearest = base.nearest.copy()
    depth = base.depth.copy()
    if len(top.projection.index):
        # What is drawn over is small: only the pixels around it are compared.
        left, bottom = top.projection.box[:, [0, 2]].min(axis=0)
        right, upper = top.projection.box[:, [1, 3]].max(axis=0)
        there = slice(bottom, upper + 1), slice(left, right + 1)
        over = (top.nearest[there] >= 0) & (top.depth[there] < base.depth[there])
        nearest[there][over] = top.nearest[there][over] + len(base.projection.index)
        depth[there][over] = top.depth[there][over]
    prims = np.concatenate([base.prims, top.prims])
    return Picture(base.camera, prims, merged, nearest, depth, top.names)


def colour_picture(
    picture: Picture, lights: Lights, rasterizer: Rasterizer, antialias: bool = True
) -> Pixels:
    """Return RGB (h, w, 3) of a picture; with `antialias`, its jagged pixels smoothed."""
    factors = rasterizer.creases(picture.depth)
    prims = picture.prims
    projection = picture.projection
    camera = picture.camera
    nearest = picture.nearest
    rgb = rasterizer.shade(prims, projection, camera, picture.depth, nearest, factors, lights)
    if antialias:
        rasterizer.smooth(prims, projection, camera, nearest, factors, lights, rgb)
    return rgb
