"""Pictures of surface normals."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.render.picture import Picture
from infthor_sim.render.shading_numpy import surface_normals

__all__ = ["normal_image"]


def normal_image(picture: Picture) -> NDArray[np.uint8]:
    """Return normals (h, w, 4), bottom row first: right, up, towards the camera, each -1 to 1 as 0
    to 255; then 255."""
    ys, xs, world = surface_normals(
        picture.prims, picture.projection, picture.camera, picture.depth, picture.nearest
    )
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
