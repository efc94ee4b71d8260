"""Pictures of surface normals."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.picture import Picture
from infthor_sim.render.primitives import AXES, BOTTOM, FORM, HALF, TOP, Form

_RIM = 1.0 - 1e-6  # |y| of hits that count as on a cylinder's flat end, with a margin for rounding


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
