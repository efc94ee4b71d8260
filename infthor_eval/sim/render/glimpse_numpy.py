"""Whether a thing is seen at all, in numpy: the same answer as `glimpse_numba`."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, Projection
from infthor_eval.sim.render.raster_numpy import cast, hit

__all__ = ["shows"]


def shows(prims: Array, seen: Projection, camera: Camera, own: NDArray[np.bool_], least: int) -> bool:
    """Whether at least `least` pixels show one of the primitives that are marked in `own` (n,), by order in `seen`."""
    us, vs = camera.rays()
    kept = replace(seen, **{name: getattr(seen, name)[own] for name in ("index", "origin", "steps", "box", "near")})
    depths, nearest = cast(prims, kept, camera)
    ys, xs = np.nonzero(nearest >= 0)
    depth, first = depths[ys, xs], np.nonzero(own)[0][nearest[ys, xs]]
    for k in np.nonzero(~own)[0]:
        if len(ys) < least:
            break
        x0, x1, y0, y1 = seen.box[k]
        within = np.nonzero((xs >= x0) & (xs <= x1) & (ys >= y0) & (ys <= y1))[0]
        step, u, v = seen.steps[k], us[xs[within]], vs[ys[within]]
        d = [(step[0, i] + u * step[1, i]) + v * step[2, i] for i in range(3)]
        t = hit(prims[seen.index[k]], seen.origin[k], d, camera.near)
        hidden = (t > camera.near) & ((t < depth[within]) | ((t == depth[within]) & (k < first[within])))
        left = np.delete(np.arange(len(ys)), within[hidden])
        ys, xs, depth, first = ys[left], xs[left], depth[left], first[left]
    return len(ys) >= least
