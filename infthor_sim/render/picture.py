"""Pictures from a camera: colours, depth, normals, and the object that each pixel shows."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection
from infthor_sim.render.lighting import Lights
from infthor_sim.render.primitives import AXES, BOTTOM, FORM, HALF, INSTANCE, TOP, Form

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
_SOURCES = (  # every file that compiled code comes from
    "camera.py", "creases_numba.py", "grouping_numba.py", "lighting.py", "patterns.py",
    "primitives.py", "probe_numba.py", "projection_numba.py", "raster_numba.py",
    "shading_numba.py", "smoothing_numba.py", "table.py",
)  # fmt: skip
_HERE = Path(__file__).parent
_RIM = 1.0 - 1e-6  # |y| of hits that count as on a cylinder's flat end, with a margin for rounding


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


def digest_of_colours(
    picture: Picture, lights: Lights, rasterizer: Rasterizer, antialias: bool = True
) -> str:
    """Return a digest of all that `colour_picture` depends on; pictures that share it are equal.

    That is the primitives that pixels show, which of them each pixel shows, the camera, the light;
    neither objects' names nor what is hidden.
    """
    shown = rasterizer.count(picture.nearest, len(picture.projection.index)) > 0
    numbers = np.append(np.cumsum(shown), 0).astype(np.uint16)  # the void, -1, takes the last: 0
    prims = np.delete(picture.prims[picture.projection.index[shown]], INSTANCE, axis=1)
    camera = picture.camera
    content = hashlib.blake2b(digest_size=16)
    for part in (prims, camera.position, camera.matrix, lights.lamps, numbers[picture.nearest]):
        content.update(np.ascontiguousarray(part).data)
    rest = camera.field_of_view, camera.near, camera.far, lights.daylight, antialias
    content.update(repr((rest, picture.nearest.shape, prims.shape)).encode())
    return content.hexdigest()


def drop_stale_kernels(folder: Path = _HERE) -> bool:
    """Remove kernels compiled from other sources than those in `folder`; return if any were.

    Numba recompiles a kernel when its own file changes, but not when a function or constant changes
    that it takes from another file. A digest of all the sources beside the cache shows when it is
    stale.
    """
    content = b"".join((folder / name).read_bytes() for name in _SOURCES)
    sources = hashlib.blake2b(content, digest_size=16).hexdigest()
    cache = folder / "__pycache__"
    stamp = cache / "kernels.stamp"
    if stamp.exists() and stamp.read_text(encoding="ascii") == sources:
        return False
    try:
        stale = [*cache.glob("*_numba.*.nbi"), *cache.glob("*_numba.*.nbc")]
        for path in stale:
            path.unlink(missing_ok=True)
        cache.mkdir(exist_ok=True)
        stamp.write_text(sources, encoding="ascii")
    except OSError:  # a read-only installation, whose files change all together
        return False
    return bool(stale)


def normal_image(picture: Picture) -> NDArray[np.uint8]:
    """Return normals (h, w, 4), bottom row first, each component from -1 to 1 as 0 to 255.

    The channels are right, up, towards the camera, and 255.
    """
    ys, xs, world = _surface_normals(picture)
    us, vs = picture.camera.rays()
    local = world @ picture.camera.matrix
    # A normal may point away from the camera, as inside a cup: then the surface is seen from its
    # other side.
    away = local[:, 0] * us[xs] + local[:, 1] * vs[ys] + local[:, 2] > 0
    local[away] *= -1.0
    local[:, 2] *= -1.0
    image = np.full((*picture.nearest.shape, 4), 255, dtype=np.uint8)
    image[..., :3] = 0
    image[ys, xs, :3] = np.round((local * 0.5 + 0.5) * 255)
    return image


def _surface_normals(picture: Picture) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Return rows, columns and world normals (n, 3), of either sign, of what pixels show."""
    us, vs = picture.camera.rays()
    ys, xs = np.nonzero(picture.nearest >= 0)
    order = picture.nearest[ys, xs]
    u = us[xs]
    v = vs[ys]
    t = picture.depth[ys, xs]
    o = picture.projection.origin[order]
    s = picture.projection.steps[order]
    local = [o[:, i] + t * (s[:, 0, i] + u * s[:, 1, i] + v * s[:, 2, i]) for i in range(3)]
    normal, _, _ = surface(picture.prims[picture.projection.index[order]], local)
    return ys, xs, np.stack(normal, axis=1)


def surface(p: Array, local: list[Array]) -> tuple[list[Array], Array, Array]:
    """Return world normals (3 arrays) and two surface coordinates (metres) of hit points.

    Args:
        p: the primitive of each point (n, COLUMNS).
        local: the points' coordinates (3 arrays) in the scaled frames of their primitives.
    """
    x, y, z = local
    form = p[:, FORM]
    ax = np.abs(x)
    ay = np.abs(y)
    az = np.abs(z)
    on_x = (ax >= ay) & (ax >= az)
    on_y = ~on_x & (ay >= az)
    k = (p[:, TOP] - p[:, BOTTOM]) * 0.5
    m = (p[:, BOTTOM] + p[:, TOP]) * 0.5
    box = form == Form.BOX
    ball = (form == Form.ELLIPSOID) | (form == Form.BOWL)
    cap = (ay >= _RIM) & ~((y > 0) & (form == Form.CUP))
    nx = np.where(box, np.where(on_x, x, 0.0), np.where(ball | ~cap, x, 0.0))
    nz = np.where(box, np.where(on_x | on_y, 0.0, z), np.where(ball | ~cap, z, 0.0))
    ny = np.where(
        box, np.where(on_y, y, 0.0), np.where(ball, y, np.where(cap, y, -k * (m + k * y)))
    )
    ny = np.where(form == Form.BOWL, (y - 1.0) * 0.25, ny)
    hx = p[:, HALF]
    hy = p[:, HALF + 1]
    hz = p[:, HALF + 2]
    nx = nx / hx
    ny = ny / hy
    nz = nz / hz
    normal = [
        p[:, AXES + i] * nx + p[:, AXES + 3 + i] * ny + p[:, AXES + 6 + i] * nz for i in range(3)
    ]
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) + 1e-12
    mx = x * hx
    my = y * hy
    mz = z * hz
    a = np.where(box, np.where(on_x, mz, mx), mx + mz)
    b = np.where(box & on_y, mz, my)
    return [n / length for n in normal], a, b
