"""Checking whether cameras see one object, without drawing their pictures."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.picture import Rasterizer
from infthor_sim.render.primitives import AXES, CENTER, HALF, INSTANCE

_SLACK = 1e-6  # metres; what touches the region between camera and object counts as in it


class VisibilityProbe:
    """Checks whether one instance is visible, from many places and in many directions.

    Args:
        prims: the primitives of the scene (n, COLUMNS).
        instance: index of the instance to look for.
        rasterizer: implementation of the ray caster.
    """

    def __init__(self, prims: Array, instance: int, rasterizer: Rasterizer) -> None:
        reach = np.einsum(
            "nij,ni->nj",
            np.abs(prims[:, AXES : AXES + 9].reshape(-1, 3, 3)),
            prims[:, HALF : HALF + 3],
        )
        self._prims = prims
        self._rasterizer = rasterizer
        self._low = prims[:, CENTER : CENTER + 3] - reach
        self._high = prims[:, CENTER : CENTER + 3] + reach
        self._own: NDArray[np.bool_] = prims[:, INSTANCE] == instance

    def seen_by(self, camera: PinholeCamera, matrices: Array, min_pixels: int) -> NDArray[np.bool_]:
        """Return in which directions (n, 3, 3) of a camera enough pixels show the instance."""
        if not self._own.any():
            return np.zeros(len(matrices), dtype=np.bool_)
        near = self._between(camera.position)
        return self._rasterizer.sees(
            self._prims[near], self._own[near], camera, matrices, min_pixels
        )

    def _between(self, eye: Array) -> NDArray[np.bool_]:
        """Mark the instance's primitives and those that could hide it from `eye` (n,)."""
        # Everything that could hide it overlaps the box around the eye and the instance. That
        # leaves few primitives.
        low = np.minimum(eye, self._low[self._own].min(axis=0)) - _SLACK
        high = np.maximum(eye, self._high[self._own].max(axis=0)) + _SLACK
        near: NDArray[np.bool_] = ((self._low <= high) & (self._high >= low)).all(axis=1)
        return near
