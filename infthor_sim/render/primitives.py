"""The ray caster's primitives: boxes, ellipsoids, (tapered) cylinders, bowls; one a row.

A row holds the primitive's world pose, half extents, colour and material; see the column constants.
Plain arrays, as numba compiles loops over them and one numpy call transforms them all.

In the primitive's own frame, scaled by its half extents, a box is [-1, 1]^3 and an ellipsoid the
unit sphere. A cylinder has its axis along y, with radius `BOTTOM` at y = -1 and `TOP` at y = 1. A
bowl is the lower half of an ellipsoid with its rim, the unit circle, at y = 1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from infthor_sim.geometry import Array

FORM = 0
CENTER = 1
HALF = 4
AXES = 7
BOTTOM = 16
TOP = 17
COLOR = 18
MATERIAL = 21
EMISSION = 22
INSTANCE = 23
COLUMNS = 24
_MIN_HALF = 5e-4  # metres; half extents are divided by, so thinner parts are drawn this thick

Color = tuple[float, float, float]


class Form(IntEnum):
    """Forms of primitives."""

    BOX = 0
    ELLIPSOID = 1
    CYLINDER = 2
    CUP = 3  # a cylinder without its top, so that its inside shows
    BOWL = 4  # the lower half of an ellipsoid, open at the top


class Material(IntEnum):
    """Surface patterns."""

    PLAIN = 0
    WOOD = 1
    PLANKS = 2
    TILES = 3
    FABRIC = 4
    STONE = 5
    METAL = 6
    GLASS = 7
    PAPER = 8
    CARPET = 9


@dataclass(frozen=True)
class ShapePart:
    """One primitive of an object, in the object's frame.

    Attributes:
        center: centre, metres (3,).
        half: half extents, metres (3,).
        color: red, green and blue, 0 to 1.
        material: surface pattern.
        matrix: rotation (3, 3); None for none.
        bottom, top: radii at the ends of a cylinder, relative to its half extents.
        emission: share of light of its own, from 0 (lit by the lights only) to 1.
    """

    form: Form
    center: Sequence[float] | Array
    half: Sequence[float] | Array
    color: Color
    material: Material = Material.PLAIN
    matrix: Array | None = None
    bottom: float = 1.0
    top: float = 1.0
    emission: float = 0.0


def rows(parts: Iterable[ShapePart], position: Array, matrix: Array, instance: int) -> Array:
    """Return the rows (n, COLUMNS) of an object's parts in the world.

    Args:
        parts: the parts, in the object's frame.
        position: origin of the object in the world, metres (3,).
        matrix: rotation of the object (3, 3).
        instance: index of the object in the picture's table of instances.
    """
    listed = list(parts)
    out = np.zeros((len(listed), COLUMNS))
    for row, part in zip(out, listed, strict=True):
        axes = matrix if part.matrix is None else matrix @ part.matrix
        row[FORM] = part.form
        row[CENTER : CENTER + 3] = position + matrix @ np.asarray(part.center, dtype=float)
        row[HALF : HALF + 3] = np.maximum(part.half, _MIN_HALF)
        row[AXES : AXES + 9] = axes.T.reshape(9)  # the primitive's x axis, its y axis, its z axis
        row[BOTTOM] = part.bottom
        row[TOP] = part.top
        row[COLOR : COLOR + 3] = part.color
        row[MATERIAL] = part.material
        row[EMISSION] = part.emission
        row[INSTANCE] = instance
    return out
