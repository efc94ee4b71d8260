"""Points and boxes, by hand."""

import math

import pytest

from infthor_eval.manipulation.geometry import (
    distance_to,
    interpolate,
    middle_of,
    offset,
    size_of,
    xyz,
)
from infthor_eval.thor.view import Box, ThorObject, Vector

BOX = Box(Vector(1.0, 2.0, 3.0), Vector(2.0, 0.5, 4.0))  # 0..2, 1.75..2.25, 1..5


def thing(box):
    return ThorObject("Mug|1", "Mug", "mug", Vector(1.0, 1.7, 3.0), axis_aligned_bounding_box=box)


@pytest.mark.parametrize(("point", "metres"), [
    ((1.0, 2.0, 3.0), 0.0),  # its middle
    ((1.9, 2.2, 4.9), 0.0),  # within a corner
    ((2.0, 2.25, 5.0), 0.0),  # the corner
    ((2.3, 2.0, 3.0), 0.3),  # beside a face
    ((1.0, 1.25, 3.0), 0.5),  # below
    ((2.3, 2.65, 3.0), 0.5),  # off an edge: 0.3 and 0.4
    ((-1.0, 4.25, 7.0), 3.0),  # off a corner: 1, 2 and 2
])  # fmt: skip
def test_the_gap_is_to_the_nearest_point_of_the_box(point, metres):
    assert distance_to(point, thing(BOX)) == pytest.approx(metres)


def test_a_thing_without_a_box_is_a_point():
    bare = thing(None)
    assert middle_of(bare) == (1.0, 1.7, 3.0)
    assert size_of(bare) == (0.0, 0.0, 0.0)
    assert distance_to((1.0, 1.7, 0.0), bare) == 3.0
    assert distance_to((2.0, 2.7, 4.0), bare) == pytest.approx(math.sqrt(3))


def test_ways():
    assert offset((1, 2, 3), (2, 4, 6)) == (1, 2, 3)
    assert interpolate((1, 2, 3), (2, 4, 6), 0.5) == (1.5, 3, 4.5)
    assert interpolate((1, 2, 3), (2, 4, 6), 0) == (1, 2, 3)
    assert xyz((1.0, 2.0, 3.0)) == {"x": 1.0, "y": 2.0, "z": 3.0}
