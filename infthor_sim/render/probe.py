"""Checking whether cameras see one object, without drawing their pictures."""

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array
from infthor_sim.render.camera import PinholeCamera, project
from infthor_sim.render.picture import Rasterizer
from infthor_sim.render.primitives import AXES, CENTER, HALF, INSTANCE

__all__ = ["VisibilityProbe"]

_SLACK = 1e-6  # metres; what touches the region between camera and object counts as in it
# cached camera positions: callers ask for many directions from one place, standing and crouched
_PLACES = 2


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
        self._instance = instance
        self._rasterizer = rasterizer
        self._low = prims[:, CENTER : CENTER + 3] - reach
        self._high = prims[:, CENTER : CENTER + 3] + reach
        self._own: NDArray[np.bool_] = prims[:, INSTANCE] == instance
        self._between: dict[bytes, Array] = {}

    def is_seen_by(self, camera: PinholeCamera, min_pixels: int) -> bool:
        """Return whether at least `min_pixels` pixels of the camera's picture show the instance."""
        if not self._own.any():
            return False
        prims = self._relevant(camera.position)
        projection = project(prims, camera)
        own = prims[projection.index, INSTANCE] == self._instance
        return bool(own.any()) and self._rasterizer.is_visible(
            prims, projection, camera, own, min_pixels
        )

    def _relevant(self, eye: Array) -> Array:
        """Return the instance's primitives and those that could hide it from `eye`."""
        # Everything that could hide it overlaps the box around the eye and the instance. That
        # leaves few primitives.
        key = eye.tobytes()
        if key not in self._between:
            if len(self._between) == _PLACES:
                self._between.clear()
            low = np.minimum(eye, self._low[self._own].min(axis=0)) - _SLACK
            high = np.maximum(eye, self._high[self._own].max(axis=0)) + _SLACK
            self._between[key] = self._prims[
                ((self._low <= high) & (self._high >= low)).all(axis=1)
            ]
        return self._between[key]
