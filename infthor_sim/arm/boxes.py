"""Arrays of oriented boxes, and distances between pairs of them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from infthor_sim.geometry import Array

_PARALLEL = 1e-4  # sine of an angle below which two edges count as parallel
# the other two axes of each axis, in the order of cross products
_NEXT = [1, 2, 0]
_LAST = [2, 0, 1]


@dataclass(frozen=True)
class Boxes:
    """Oriented boxes, (n,) of them or, in groups of equal size, (k, n).

    Attributes:
        center: centres, metres (..., n, 3).
        axes: unit axes (..., n, 3, 3), an axis of the box per row.
        half: half extents along them, metres (..., n, 3).
    """

    center: Array
    axes: Array
    half: Array

    def __getitem__(self, index: NDArray[np.int64] | NDArray[np.bool_] | slice) -> "Boxes":
        return Boxes(self.center[index], self.axes[index], self.half[index])

    def flat(self) -> "Boxes":
        """Return the boxes without their groups (k * n), group after group."""
        return Boxes(
            self.center.reshape(-1, 3), self.axes.reshape(-1, 3, 3), self.half.reshape(-1, 3)
        )

    def bounds(self) -> tuple[Array, Array]:
        """Return the low and high corners (..., n, 3) of the axis-aligned boxes around them."""
        reach = (np.abs(self.axes) * self.half[..., None]).sum(axis=-2)
        return self.center - reach, self.center + reach

    def transform(self, origins: Array, frames: Array) -> "Boxes":
        """Return the boxes (k, n) in the world, from a local frame with k poses.

        Args:
            origins: positions of the frame, metres (k, 3): one for each group, or many for a single
                group.
            frames: rotations of the frame (k, 3, 3).
        """
        back = frames.transpose(0, 2, 1)
        center = origins[:, None] + self.center @ back
        return Boxes(center, self.axes @ back[:, None], np.broadcast_to(self.half, center.shape))


def join(parts: Sequence[Boxes], axis: int = 0) -> Boxes:
    """Return all boxes of collections, in order; with `axis` 1, join their groups one by one."""
    columns = []
    for field in fields(Boxes):
        values = [getattr(part, field.name) for part in parts]
        columns.append(np.concatenate(values, axis=axis))
    return Boxes(*columns)


def separations(first: Boxes, second: Boxes) -> Array:
    """Return gaps (n, m) in metres between n boxes and m others, without groups.

    A gap is measured along the best separating direction. It is at most the true distance, and
    negative exactly where the boxes overlap. Pairs that are far apart have infinity.
    """
    # Spheres around the boxes sort out most pairs cheaply.
    gaps = np.full((len(first.center), len(second.center)), np.inf)
    apart = np.linalg.norm(first.center[:, None] - second.center[None], axis=2)
    near = np.nonzero(
        apart < np.linalg.norm(first.half, axis=1)[:, None] + np.linalg.norm(second.half, axis=1)
    )
    if len(near[0]):
        gaps[near] = _pair_gaps(first[near[0]], second[near[1]])
    return gaps


def _pair_gaps(a: Boxes, b: Boxes) -> Array:
    """Return gaps (k,) between boxes, pair by pair, by the separating axis theorem."""
    # Two boxes are apart exactly if they are along one of 15 directions: the 3 + 3 axes of the
    # boxes, and the cross products of each pair of them. `cosines` holds the dot products of the
    # axes, from which all projections follow.
    cosines = a.axes @ b.axes.transpose(0, 2, 1)
    size = np.abs(cosines)
    between = b.center - a.center
    along_a = np.einsum("kij,kj->ki", a.axes, between)
    along_b = np.einsum("kij,kj->ki", b.axes, between)
    faces_a = np.abs(along_a) - a.half - np.einsum("kij,kj->ki", size, b.half)
    faces_b = np.abs(along_b) - b.half - np.einsum("kji,kj->ki", size, a.half)
    away = np.abs(
        along_a[:, _LAST, None] * cosines[:, _NEXT] - along_a[:, _NEXT, None] * cosines[:, _LAST]
    )
    reach_a = a.half[:, _NEXT, None] * size[:, _LAST] + a.half[:, _LAST, None] * size[:, _NEXT]
    reach_b = (
        b.half[:, None, _NEXT] * size[:, :, _LAST] + b.half[:, None, _LAST] * size[:, :, _NEXT]
    )
    # Cross products have the length of the sine, by which gaps along them are divided. Nearly
    # parallel edges are left out: the division would blow up rounding, and the axes themselves
    # suffice then.
    sine = np.sqrt(np.maximum(1.0 - cosines**2, 0.0))
    edges = np.where(
        sine > _PARALLEL, (away - reach_a - reach_b) / np.maximum(sine, _PARALLEL), -np.inf
    )
    gaps: Array = np.maximum(np.maximum(faces_a, faces_b).max(axis=1), edges.max(axis=(1, 2)))
    return gaps


def sphere_gaps(boxes: Boxes, center: Array) -> Array:
    """Return distances (n,) in metres from a point (3,) to the boxes; 0 inside."""
    local = np.abs(np.einsum("nij,nj->ni", boxes.axes, center - boxes.center))
    gaps: Array = np.linalg.norm(np.maximum(local - boxes.half, 0.0), axis=1)
    return gaps
