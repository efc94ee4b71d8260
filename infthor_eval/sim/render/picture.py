"""Pictures of a world from a camera: colours, depth and which object each pixel shows."""

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, Projection, project
from infthor_eval.sim.render.kernel_cache import drop_stale_kernels
from infthor_eval.sim.render.lighting import Lights
from infthor_eval.sim.render.primitives import COLUMNS, INSTANCE
from infthor_eval.sim.render.relief import relief
from infthor_eval.sim.render.smoothing import jagged

__all__ = ["Picture", "Rasterizer", "cast_picture", "choose_rasterizer", "colour_picture"]

Cast = Callable[[Array, Projection, Camera], tuple[Array, NDArray[np.int32]]]
Pixels = NDArray[np.uint8]
Places = tuple[NDArray[np.int64], NDArray[np.int64]]
Shade = Callable[[Array, Projection, Camera, Array, NDArray[np.int32], Array, Lights], Pixels]
Shows = Callable[[Array, Projection, Camera, NDArray[np.bool_], int], bool]
Smooth = Callable[[Array, Projection, Camera, NDArray[np.int32], Array, Lights, Places, Pixels], None]


@dataclass(frozen=True)
class Rasterizer:
    """One implementation of casting, shading, smoothing, and looking for one thing."""

    name: str
    cast: Cast
    shade: Shade
    smooth: Smooth
    shows: Shows


@dataclass(frozen=True)
class Picture:
    """What a camera sees, bottom row first.

    Attributes:
        names: object ids (or names of walls) that `instances` indexes.
        depth: metres along the camera's forward axis (h, w).
        instances: index into `names`, -1 for nothing (h, w).
    """

    camera: Camera
    prims: Array
    seen: Projection
    nearest: NDArray[np.int32]
    depth: Array
    instances: NDArray[np.int32]
    names: tuple[str, ...]


def choose_rasterizer(name: str | None = None) -> Rasterizer:
    """The rasterizer: `numba`, or `numpy` where numba is not installed or INFTHOR_SIM_RENDERER asks for it."""
    chosen = name or os.environ.get("INFTHOR_SIM_RENDERER", "")
    if chosen != "numpy":
        drop_stale_kernels()
        try:
            from infthor_eval.sim.render import glimpse_numba, raster_numba, shading_numba, smoothing_numba
        except ModuleNotFoundError:
            if chosen == "numba":
                raise
        else:
            return Rasterizer(
                "numba", raster_numba.cast, shading_numba.shade, smoothing_numba.smooth, glimpse_numba.shows
            )
    from infthor_eval.sim.render import glimpse_numpy, raster_numpy, shading_numpy, smoothing_numpy

    return Rasterizer("numpy", raster_numpy.cast, shading_numpy.shade, smoothing_numpy.smooth, glimpse_numpy.shows)


def cast_picture(
    prims: Array, names: tuple[str, ...], camera: Camera, rasterizer: Rasterizer, base: Picture | None = None
) -> Picture:
    """Casts primitives (n, COLUMNS); over `base`, where given, keeping its pixels that are nearer.

    `base` must be cast with the same camera.
    """
    seen = project(prims, camera) if len(prims) else _nothing()
    depth, nearest = rasterizer.cast(prims, seen, camera)
    lookup = np.append(prims[seen.index, INSTANCE], -1).astype(np.int32)
    instances = lookup[nearest]
    if base is None:
        return Picture(camera, prims, seen, nearest, depth, instances, names)
    over = (nearest >= 0) & (depth < base.depth)
    merged = Projection(
        np.append(base.seen.index, seen.index + len(base.prims)),
        np.concatenate([base.seen.origin, seen.origin]),
        np.concatenate([base.seen.steps, seen.steps]),
        np.concatenate([base.seen.box, seen.box]),
        np.append(base.seen.near, seen.near),
    )
    return Picture(
        camera,
        np.concatenate([base.prims, prims]),
        merged,
        np.where(over, nearest + len(base.seen.index), base.nearest).astype(np.int32),
        np.where(over, depth, base.depth),
        np.where(over, instances, base.instances),
        names,
    )


def colour_picture(picture: Picture, lights: Lights, rasterizer: Rasterizer, antialias: bool = True) -> Pixels:
    """RGB (h, w, 3) of a cast picture; with `antialias`, its jagged places smoothed."""
    factors = relief(picture.depth)
    prims, seen, camera, nearest = picture.prims, picture.seen, picture.camera, picture.nearest
    rgb = rasterizer.shade(prims, seen, camera, picture.depth, nearest, factors, lights)
    if antialias:
        rasterizer.smooth(prims, seen, camera, nearest, factors, lights, jagged(rgb), rgb)
    return rgb


def _nothing() -> Projection:
    return project(np.zeros((0, COLUMNS)), Camera(np.zeros(3), np.eye(3), 60.0, 1, 1))
