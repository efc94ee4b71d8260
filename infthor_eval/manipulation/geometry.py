"""Points, and boxes of objects, in metres of the world."""

import math

from infthor_eval.thor.view import ThorObject, Vector

__all__ = ["Point", "along", "away", "gap", "middle_of", "point_of", "size_of", "xyz"]

Point = tuple[float, float, float]


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
