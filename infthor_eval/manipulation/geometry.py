"""Points, and boxes of objects, in metres of the world."""

import math
from typing import NamedTuple

from infthor_eval.thor.view import ThorObject, Vector

Point = tuple[float, float, float]


class Corners(NamedTuple):
    """A box along the world's axes: corners with the lowest and highest coordinates, metres."""

    low: Point
    high: Point


def point_of(vector: Vector) -> Point:
    """Return a vector of the metadata as a point."""
    return vector.x, vector.y, vector.z


def xyz(point: Point) -> dict[str, float]:
    """Return a point as calls take it."""
    return dict(zip("xyz", point, strict=True))


def offset(start: Point, end: Point) -> Point:
    """Return the vector from one point to another."""
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def interpolate(start: Point, end: Point, share: float) -> Point:
    """Return the point at a share of the way from one to another."""
    way = offset(start, end)
    return start[0] + share * way[0], start[1] + share * way[1], start[2] + share * way[2]


def middle_of(thor_object: ThorObject) -> Point:
    """Return the middle of an object's box; its origin if it has none."""
    box = thor_object.axis_aligned_bounding_box
    return point_of(thor_object.position if box is None else box.center)


def size_of(thor_object: ThorObject) -> Point:
    """Return the size of an object's box; zeros if it has none."""
    box = thor_object.axis_aligned_bounding_box
    return (0.0, 0.0, 0.0) if box is None else point_of(box.size)


def distance_to(point: Point, thor_object: ThorObject) -> float:
    """Return the metres from a point to the nearest point of an object's box."""
    apart = zip(offset(middle_of(thor_object), point), size_of(thor_object), strict=True)
    return math.hypot(*(max(0.0, abs(distance) - size / 2) for distance, size in apart))


def corners_of(thor_object: ThorObject) -> Corners:
    """Return the box of an object."""
    x, y, z = middle_of(thor_object)
    width, height, depth = size_of(thor_object)
    half = width / 2, height / 2, depth / 2
    return Corners((x - half[0], y - half[1], z - half[2]), (x + half[0], y + half[1], z + half[2]))
