"""Pictures from a camera: colours, depth, and the object that each pixel shows."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection, project
from infthor_sim.render.kernel_cache import drop_stale_kernels
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import INSTANCE

__all__ = ["Picture", "Rasterizer", "cast_picture", "colour_picture", "compiled_rasterizer"]

Cast = Callable[[Array, Projection, PinholeCamera], tuple[Array, NDArray[np.int32]]]
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
        cast: function that returns depth and nearest primitive of each pixel.
        creases: function that returns factors of brightness from the depth.
        shade: function that returns the colours of cast pixels.
        smooth: function that smooths jagged pixels of an RGB picture in place.
        sees: function that returns in which directions of a camera enough pixels show some of the
            primitives.
    """

    cast: Cast
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
        instances: index into `names`, -1 for nothing (h, w).
        names: ids of objects, and names of the parts of the shell.
    """

    camera: PinholeCamera
    prims: Array
    projection: Projection
    nearest: NDArray[np.int32]
    depth: Array
    instances: NDArray[np.int32]
    names: tuple[str, ...]


def compiled_rasterizer() -> Rasterizer:
    """Return the rasterizer compiled by numba."""
    drop_stale_kernels()  # before the imports, which load cached kernels
    from infthor_sim.render.creases_numba import crease_factors
    from infthor_sim.render.probe_numba import sees
    from infthor_sim.render.raster_numba import cast
    from infthor_sim.render.shading_numba import shade
    from infthor_sim.render.smoothing_numba import smooth

    return Rasterizer(cast, crease_factors, shade, smooth, sees)


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
    projection = project(prims, camera)
    depth, nearest = rasterizer.cast(prims, projection, camera)
    lookup = np.append(prims[projection.index, INSTANCE], -1).astype(np.int32)
    instances = lookup[nearest]  # -1, nothing, takes the last entry, which is -1 too
    if base is None:
        return Picture(camera, prims, projection, nearest, depth, instances, names)
    over = (nearest >= 0) & (depth < base.depth)
    merged = Projection(
        np.append(base.projection.index, projection.index + len(base.prims)),
        np.concatenate([base.projection.origin, projection.origin]),
        np.concatenate([base.projection.steps, projection.steps]),
        np.concatenate([base.projection.box, projection.box]),
        np.append(base.projection.near, projection.near),
    )
    return Picture(
        camera,
        np.concatenate([base.prims, prims]),
        merged,
        np.where(over, nearest + len(base.projection.index), base.nearest).astype(np.int32),
        np.where(over, depth, base.depth),
        np.where(over, instances, base.instances),
        names,
    )


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
