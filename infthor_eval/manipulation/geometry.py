"""Points, and boxes of objects, in metres of the world."""

import math
from typing import NamedTuple

from infthor_eval.thor.view import ThorObject, Vector

__all__ = ["Corners", "Point", "along", "away", "corners_of", "gap", "middle_of", "point_of", "size_of", "xyz"]

Point = tuple[float, float, float]


class Corners(NamedTuple):
    """A box by its corners with the lowest and the highest numbers, metres."""

    low: Point
    high: Point


def point_of(vector: Vector) -> Point:
    """A vector of the metadata as a point."""
    return vector.x, vector.y, vector.z


def xyz(point: Point) -> dict[str, float]:
    """A point as calls take it."""
    return dict(zip("xyz", point, strict=True))


def away(start: Point, end: Point) -> Point:
    """The way from one point to another."""
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def along(start: Point, end: Point, share: float) -> Point:
    """The point after a share of the way from one to another."""
    x, y, z = (a + share * (b - a) for a, b in zip(start, end, strict=True))
    return x, y, z


def middle_of(item: ThorObject) -> Point:
    """The middle of an object's box; its origin where it has none."""
    box = item.axis_aligned_bounding_box
    return point_of(item.position if box is None else box.center)


def size_of(item: ThorObject) -> Point:
    """The size of an object's box; nothing where it has none."""
    box = item.axis_aligned_bounding_box
    return (0.0, 0.0, 0.0) if box is None else point_of(box.size)


def gap(point: Point, item: ThorObject) -> float:
    """Metres from a point to the nearest point of an object's box."""
    apart = away(middle_of(item), point)
    return math.hypot(*(max(0.0, abs(d) - size / 2) for d, size in zip(apart, size_of(item), strict=True)))


def corners_of(item: ThorObject) -> Corners:
    """The box of an object."""
    (x, y, z), (width, height, depth) = middle_of(item), size_of(item)
    half = width / 2, height / 2, depth / 2
    return Corners((x - half[0], y - half[1], z - half[2]), (x + half[0], y + half[1], z + half[2]))
