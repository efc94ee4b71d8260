"""Whether a camera sees one thing, without drawing the picture."""

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array
from infthor_eval.sim.render.camera import Camera, project
from infthor_eval.sim.render.picture import Rasterizer
from infthor_eval.sim.render.primitives import AXES, CENTER, HALF, INSTANCE

__all__ = ["Glimpse"]

_SLACK = 1e-6  # metres; what touches the way to the thing counts as being in it
_PLACES = 2  # that are remembered: one asks for many directions from one place, standing and crouched


class Glimpse:
    """Looks for one instance among primitives, from many places and in many directions.

    Args:
        prims: the primitives of the scene (n, COLUMNS).
        instance: what is looked for.
        rasterizer: casts the rays.
    """

    def __init__(self, prims: Array, instance: int, rasterizer: Rasterizer) -> None:
        reach = np.einsum("nij,ni->nj", np.abs(prims[:, AXES : AXES + 9].reshape(-1, 3, 3)), prims[:, HALF : HALF + 3])
        self._prims, self._instance, self._rasterizer = prims, instance, rasterizer
        self._low, self._high = prims[:, CENTER : CENTER + 3] - reach, prims[:, CENTER : CENTER + 3] + reach
        self._own: NDArray[np.bool_] = prims[:, INSTANCE] == instance
        self._between: dict[bytes, Array] = {}

    def seen_by(self, camera: Camera, least: int) -> bool:
        """Whether at least `least` pixels of the camera's picture show the instance."""
        if not self._own.any():
            return False
        prims = self._from(camera.position)
        seen = project(prims, camera)
        own = prims[seen.index, INSTANCE] == self._instance
        return bool(own.any()) and self._rasterizer.shows(prims, seen, camera, own, least)

    def _from(self, eye: Array) -> Array:
        """The instance's primitives and those that could hide it from `eye`: the others lie beside the way to it."""
        key = eye.tobytes()
        if key not in self._between:
            if len(self._between) == _PLACES:
                self._between.clear()
            low = np.minimum(eye, self._low[self._own].min(axis=0)) - _SLACK
            high = np.maximum(eye, self._high[self._own].max(axis=0)) + _SLACK
            self._between[key] = self._prims[((self._low <= high) & (self._high >= low)).all(axis=1)]
        return self._between[key]
