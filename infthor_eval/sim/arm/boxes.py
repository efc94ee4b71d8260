"""Turned boxes in bulk, and how far apart pairs of them are."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from infthor_eval.sim.geometry import Array

__all__ = ["Boxes", "join", "separations", "sphere_gaps"]

_PARALLEL = 1e-4  # sine of an angle below which the normal of two edges is left out: the faces' normals suffice
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


@dataclass(frozen=True)
class Boxes:
    """Some turned boxes, (n,) of them or, in groups of equal size, (k, n).

    Attributes:
        center: metres (..., n, 3).
        axes: unit axes (..., n, 3, 3), one axis of the box a row.
        half: half extents along them, metres (..., n, 3).
    """

    center: Array
    axes: Array
    half: Array

    def __getitem__(self, index: NDArray[np.int64] | NDArray[np.bool_] | slice) -> "Boxes":
        return Boxes(self.center[index], self.axes[index], self.half[index])

    def flat(self) -> "Boxes":
        """The boxes without their groups (k * n), group after group."""
        return Boxes(self.center.reshape(-1, 3), self.axes.reshape(-1, 3, 3), self.half.reshape(-1, 3))

    def bounds(self) -> tuple[Array, Array]:
        """Low and high corners (..., n, 3) of the axis-aligned boxes around them."""
        reach = (np.abs(self.axes) * self.half[..., None]).sum(axis=-2)
        return self.center - reach, self.center + reach

    def moved(self, origins: Array, frames: Array) -> "Boxes":
        """Groups (k, n) of the boxes in the world, from a frame that stands at some places.

        Args:
            origins: where the frame stands, metres (k, 3); one place for each group, or many for boxes of one group.
            frames: its rotations (k, 3, 3).
        """
        back = frames.transpose(0, 2, 1)
        center = origins[:, None] + self.center @ back
        return Boxes(center, self.axes @ back[:, None], np.broadcast_to(self.half, center.shape))


def join(parts: Sequence[Boxes], axis: int = 0) -> Boxes:
    """All boxes of some collections, in order; with `axis` 1, the groups of each beside those of the others."""
    return Boxes(*(np.concatenate([getattr(p, f.name) for p in parts], axis=axis) for f in fields(Boxes)))


def separations(first: Boxes, second: Boxes) -> Array:
    """Gaps (n, m) in metres between each of n boxes and each of m others, ungrouped; negative: how deep they overlap.

    A gap is that along the best separating direction (of the faces and of pairs of edges), so it is at most the true
    distance, and negative exactly where the boxes overlap. Pairs that are far apart have infinity.
    """
    gaps = np.full((len(first.center), len(second.center)), np.inf)
    apart = np.linalg.norm(first.center[:, None] - second.center[None], axis=2)
    near = np.nonzero(apart < np.linalg.norm(first.half, axis=1)[:, None] + np.linalg.norm(second.half, axis=1))
    if len(near[0]):
        gaps[near] = _paired(first[near[0]], second[near[1]])
    return gaps


def _paired(a: Boxes, b: Boxes) -> Array:
    """Gaps (k,) between the boxes of two collections, pair by pair: the theorem of separating axes."""
    cosines = a.axes @ b.axes.transpose(0, 2, 1)
    size = np.abs(cosines)
    between = b.center - a.center
    of_a = np.einsum("kij,kj->ki", a.axes, between)
    of_b = np.einsum("kij,kj->ki", b.axes, between)
    faces_a = np.abs(of_a) - a.half - np.einsum("kij,kj->ki", size, b.half)
    faces_b = np.abs(of_b) - b.half - np.einsum("kji,kj->ki", size, a.half)
    away = np.abs(of_a[:, _LAST, None] * cosines[:, _NEXT] - of_a[:, _NEXT, None] * cosines[:, _LAST])
    reach_a = a.half[:, _NEXT, None] * size[:, _LAST] + a.half[:, _LAST, None] * size[:, _NEXT]
    reach_b = b.half[:, None, _NEXT] * size[:, :, _LAST] + b.half[:, None, _LAST] * size[:, :, _NEXT]
    sine = np.sqrt(np.maximum(1.0 - cosines**2, 0.0))
    edges = np.where(sine > _PARALLEL, (away - reach_a - reach_b) / np.maximum(sine, _PARALLEL), -np.inf)
    gaps: Array = np.maximum(np.maximum(faces_a, faces_b).max(axis=1), edges.max(axis=(1, 2)))
    return gaps


def sphere_gaps(boxes: Boxes, center: Array) -> Array:
    """Distances (n,) in metres from a point (3,) to the boxes; 0 inside."""
    local = np.abs(np.einsum("nij,nj->ni", boxes.axes, center - boxes.center))
    gaps: Array = np.linalg.norm(np.maximum(local - boxes.half, 0.0), axis=1)
    return gaps
