"""Rotations and boxes in Unity's frame: left-handed, y up, z forward, metres and degrees."""

import math
from collections.abc import Mapping, Sequence
from decimal import ROUND_HALF_UP, Decimal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_VERTICAL = 1e-6  # cosine of a pitch below which yaw and roll turn about the same axis

_CORNERS = np.array(  # of a box, in the order of AI2-THOR's `cornerPoints`
    [
        [1, -1, 1],
        [-1, -1, 1],
        [-1, -1, -1],
        [1, -1, -1],
        [1, 1, 1],
        [-1, 1, 1],
        [-1, 1, -1],
        [1, 1, -1],
    ],
    dtype=float,
)


def euler_matrix(rotation: Sequence[float] | Array) -> Array:
    """Return the matrix (3, 3) of Unity's Euler angles (x, y, z) in degrees: z first, then x, y."""
    x, y, z = map(math.radians, rotation)
    cx = math.cos(x)
    sx = math.sin(x)
    cy = math.cos(y)
    sy = math.sin(y)
    cz = math.cos(z)
    sz = math.sin(z)
    return np.array(
        [
            [cy * cz + sy * sx * sz, -cy * sz + sy * sx * cz, sy * cx],
            [cx * sz, cx * cz, -sx],
            [-sy * cz + cy * sx * sz, sy * sz + cy * sx * cz, cy * cx],
        ]
    )


def yaw_matrix(yaw: float) -> Array:
    """Return the matrix (3, 3) of a turn about the vertical, degrees; 0: along +z, 90: along +x."""
    return euler_matrix((0.0, yaw, 0.0))


def matrix_euler(matrix: Array) -> Array:
    """Return Unity's Euler angles (3,) of a matrix, degrees in [0, 360); straight up, z is 0."""
    x = math.asin(min(max(-float(matrix[1, 2]), -1.0), 1.0))  # clamped, as rounding may exceed 1
    if abs(math.cos(x)) < _VERTICAL:
        y = math.atan2(-matrix[2, 0], matrix[0, 0])
        z = 0.0
    else:
        y = math.atan2(matrix[0, 2], matrix[2, 2])
        z = math.atan2(matrix[1, 0], matrix[1, 1])
    angles: Array = np.round(np.degrees(np.array([x, y, z])), 6) % 360.0
    return angles


def axis_angle(turn: Array) -> tuple[Array, float]:
    """Return the unit axis (3,) and angle, 0 to 180 degrees, of a rotation (3, 3); of none, x."""
    # The skew part is the axis times twice the sine. Near half a turn the sine vanishes and the
    # symmetric part, whose columns lie along the axis, gives it.
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = float(np.linalg.norm(skew)), float(np.trace(turn)) - 1.0
    if sine > 1e-6:
        return skew / sine, math.degrees(math.atan2(sine, cosine))
    if cosine > 0:
        return np.array([1.0, 0.0, 0.0]), 0.0
    columns = turn + np.eye(3)
    column = columns[:, int(np.argmax(np.diag(columns)))]
    return column / np.linalg.norm(column), 180.0


def axis_rotation(axis: Array, degrees: float) -> Array:
    """Return the rotation (3, 3) about a unit axis (3,), by Rodrigues' formula."""
    angle = math.radians(degrees)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    matrix: Array = np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew
    return matrix


def wrap_degrees(angle: float) -> float:
    """Return an angle in degrees as the same angle within -180 to 180."""
    return (angle + 180.0) % 360.0 - 180.0


def corners(center: Array, size: Array, rotation: Array | None = None) -> Array:
    """Return a box's corners (8, 3), bottom ones first, in AI2-THOR's order; `rotation` (3, 3)."""
    offsets = _CORNERS * (np.asarray(size) * 0.5)
    return center + (offsets if rotation is None else offsets @ rotation.T)


def cross(first: Array, second: Array) -> Array:
    """Return cross products (n, 3) of vectors (n, 3); for few, much faster than numpy's own."""
    (ax, ay, az) = first.T
    (bx, by, bz) = second.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def convex_hull(points: Array) -> list[Array]:
    """Return the hull's corners of points (n, 2), in order; none is between two others."""
    # Andrew's monotone chain. Rounding merges corners of upright boxes, which coincide from above.
    distinct = {(x, z) for x, z in np.round(points, 6).tolist()}
    ordered = [np.array(point) for point in sorted(distinct)]
    return _half_hull(ordered)[:-1] + _half_hull(ordered[::-1])[:-1]


def _half_hull(ordered: list[Array]) -> list[Array]:
    hull: list[Array] = []
    for point in ordered:
        while len(hull) > 1 and _turn(hull[-2], hull[-1], point) <= 1e-9:
            hull.pop()
        hull.append(point)
    return hull


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def to_xyz(vector: Sequence[float] | Array) -> dict[str, float]:
    """Return a vector of 3 as `{"x", "y", "z"}`, the form of the protocol."""
    return {"x": float(vector[0]), "y": float(vector[1]), "z": float(vector[2])}


def to_array(value: Mapping[str, float] | Sequence[float]) -> Array:
    """Return a vector of 3 from `{"x", "y", "z"}` (absent components are 0) or a sequence."""
    if isinstance(value, Mapping):
        return np.array([float(value.get(axis, 0.0)) for axis in "xyz"])
    return np.array([float(v) for v in value])


def round_vector(vector: Array, digits: int = 4) -> list[float]:
    """Return a vector as plain floats, rounded so that equal states serialise to equal bytes."""
    return [round(float(v), digits) + 0.0 for v in vector]  # + 0.0 turns -0.0 into 0.0


def round_xyz(vector: Array) -> dict[str, float]:
    """Return a position or angles (3,) as in the metadata: `{"x", "y", "z"}`, 6 digits."""
    return to_xyz(round_vector(vector, 6))


def object_id(object_type: str, position: Sequence[float] | Array) -> str:
    """Return AI2-THOR's id of an object by its first position: `Mug|-01.90|+00.94|+00.38`."""
    return "|".join([object_type, *(_coordinate_text(float(v)) for v in position)])


def _coordinate_text(value: float) -> str:
    """Return a coordinate as Unity's Mono prints it in ids."""
    # Mono prints the single-precision number with 7 digits first and rounds that text to two
    # decimals, halves away from zero. A negative number that rounds to zero loses its sign:
    # `00.00`. Ids of recordings must match to the letter.
    decimal = Decimal(f"{float(np.float32(value)):.7g}").quantize(Decimal("0.01"), ROUND_HALF_UP)
    sign = "+" if value >= 0 else "-" if decimal else ""
    return f"{sign}{abs(decimal):05.2f}"


def aabb_overlap(low_a: Array, high_a: Array, low_b: Array, high_b: Array) -> bool:
    """Return whether two axis-aligned boxes, given by their low and high corners, share volume."""
    return bool((low_a < high_b).all() and (low_b < high_a).all())


def aabb_gap(point: Array, low: Array, high: Array) -> float:
    """Return metres from a point to an axis-aligned box; any number of dimensions, 0 inside."""
    nearest = np.clip(point, low, high)
    return float(np.linalg.norm(point - nearest))


def segment_gaps(points: Array, start: Array, end: Array) -> Array:
    """Return metres from points (n, 2) to the straight line between two points (2,)."""
    along = end - start
    share = np.clip((points - start) @ along / max(float(along @ along), 1e-9), 0.0, 1.0)
    gaps: Array = np.hypot(*(points - (start + share[:, None] * along)).T)
    return gaps


def level_gaps(points: Array, low: Array, high: Array) -> Array:
    """Return horizontal metres from (x, z), (n, 2) or (2,), to a box by its corners (3,)."""
    nearest = np.clip(points, low[[0, 2]], high[[0, 2]])
    gaps: Array = np.hypot(*(points - nearest).T)
    return gaps
