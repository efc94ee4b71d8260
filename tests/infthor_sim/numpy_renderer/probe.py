"""Whether an object is visible, in numpy; the same answers as `probe_numba`."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, Projection

from .projection import project
from .raster import cast, hit

__all__ = ["sees"]


def sees(
    prims: Array,
    own: NDArray[np.bool_],
    camera: PinholeCamera,
    matrices: Array,
    min_pixels: int,
) -> NDArray[np.bool_]:
    """Return in which directions at least `min_pixels` pixels show a primitive marked in `own`."""
    seen = np.zeros(len(matrices), dtype=bool)
    for index, matrix in enumerate(matrices):
        turned = replace(camera, matrix=matrix)
        projection = project(prims, turned)
        mine = own[projection.index]
        seen[index] = mine.any() and _is_visible(prims, projection, turned, mine, min_pixels)
    return seen


def _is_visible(
    prims: Array,
    projection: Projection,
    camera: PinholeCamera,
    own: NDArray[np.bool_],
    min_pixels: int,
) -> bool:
    """Return whether at least `min_pixels` pixels show a primitive marked in `own` (n,)."""
    us, vs = camera.rays()
    # First the pixels that the object would show alone; then each other primitive takes away those
    # that it hides.
    fields = ("index", "origin", "steps", "box", "near")
    kept = replace(projection, **{name: getattr(projection, name)[own] for name in fields})
    depths, nearest = cast(prims, kept, camera)
    ys, xs = np.nonzero(nearest >= 0)
    depth = depths[ys, xs]
    first = np.nonzero(own)[0][nearest[ys, xs]]
    for k in np.nonzero(~own)[0]:
        if len(ys) < min_pixels:
            break
        x0, x1, y0, y1 = projection.box[k]
        within = np.nonzero((xs >= x0) & (xs <= x1) & (ys >= y0) & (ys <= y1))[0]
        t = hit(prims, projection, int(k), (us[xs[within]], vs[ys[within]]), camera.near)
        hidden = (t > camera.near) & (
            (t < depth[within]) | ((t == depth[within]) & (k < first[within]))
        )
        left = np.delete(np.arange(len(ys)), within[hidden])
        ys = ys[left]
        xs = xs[left]
        depth = depth[left]
        first = first[left]
    return len(ys) >= min_pixels
