"""What stands in an arm's way: boxes, columns under lattices of places, cavities and doors."""

import numpy as np
import pytest

from infthor_eval.manipulation.geometry import Corners
from infthor_eval.manipulation.planner.linkage import Parts
from infthor_eval.manipulation.planner.obstacles import cavity, clearances, columns, obstacles_of
from infthor_eval.manipulation.planner.places import Entry, Places

from .test_places import board, lattice, thing


def part(x, y, z, axes=None, half=(0.1, 0.1, 0.1)):
    rotations_about = np.eye(3) if axes is None else axes
    return Parts(np.array([[(x, y, z)]]), np.array([[rotations_about]]), np.array([[half]]))


def holds(boxes, x, y, z):
    return any(
        all(a < v < b for a, v, b in zip(box.low, (x, y, z), box.high, strict=True))
        for box in boxes
    )


CUBE = obstacles_of([("Cube", Corners((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)))])


@pytest.mark.parametrize(
    ("x", "gap"), [(0.25, 0.05), (0.2, 0.0), (0.15, -0.05), (0.0, -0.2), (3.0, np.inf)]
)
def test_gaps_between_level_boxes(x, gap):
    assert clearances(part(x, 0.0, 0.0), CUBE)[0, 0, 0] == pytest.approx(gap)


def test_a_turned_box_reaches_as_far_as_its_corner():
    half = np.sqrt(0.5)
    rotations_about = np.array([(half, 0.0, half), (0.0, 1.0, 0.0), (-half, 0.0, half)])
    gap = clearances(part(0.26, 0.0, 0.0, rotations_about), CUBE)[0, 0, 0]
    assert gap == pytest.approx(0.16 - 0.1 * np.sqrt(2))


def test_of_a_thing_the_nearest_box_counts():
    boxes = [("A", Corners((1, 0, 0), (2, 1, 1))), ("A", Corners((0.3, -1, -1), (1, 1, 1))),
             ("B", Corners((0.2, -1, -1), (1, 1, 1)))]  # fmt: skip
    assert clearances(part(0.19, 0.0, 0.0), obstacles_of(boxes))[0, 0] == pytest.approx(
        [0.01, -0.09]
    )
    assert clearances(part(0.0, 0.0, 0.0), obstacles_of(())).shape == (1, 1, 0)


def test_under_a_corner_counter_there_is_room():
    arm = lattice(np.arange(0.025, 1, 0.05), np.arange(0.025, 0.5, 0.05))
    leg = lattice(np.arange(0.025, 0.5, 0.05), np.arange(0.525, 1, 0.05))
    counter = thing("CounterTop|1", 0.5, 0.4, 0.5, (1.0, 0.8, 1.0))
    boxes = columns(counter, Places(np.concatenate([arm, leg]), 0.05, 0.8))
    assert len(boxes) == 2
    assert holds(boxes, 0.9, 0.4, 0.2) and holds(boxes, 0.2, 0.4, 0.9)
    assert not holds(boxes, 0.9, 0.4, 0.9)
    assert max(box.high[1] for box in boxes) == pytest.approx(0.8)


def test_around_turned_lattices_there_is_one_box():
    flat = lattice(np.arange(-0.2, 0.21, 0.05), np.arange(-0.2, 0.21, 0.05))
    turned = flat @ np.array([(0.8, 0, 0.6), (0, 1, 0), (-0.6, 0, 0.8)])
    desk = thing("Desk|1", 0.0, 0.4, 0.0, (0.6, 0.8, 0.6))
    assert len(columns(desk, Places(turned, 0.05, 0.8))) == 1


@pytest.mark.parametrize(
    ("hinge", "left", "right"), [(-1, True, False), (1, False, True), (0, False, False)]
)
def test_a_cavity_is_open_in_front_but_for_its_door(hinge, left, right):
    places = board(heights=(0.4, 0.8), top=1.2, entered=True)
    fridge = thing("Fridge|1", 0.0, 0.75, -0.2, (0.44, 0.9, 0.8))  # its door reaches to z = -0.6
    boxes = cavity(fridge, places, Entry(2, -1, -0.175), hinge)
    assert not holds(boxes, 0.0, 0.6, 0.0) and not holds(boxes, 0.0, 0.6, -0.4)
    assert holds(boxes, 0.0, 0.79, 0.0) and holds(boxes, 0.0, 1.19, 0.0)  # a board, the roof
    assert holds(boxes, 0.22, 0.6, 0.0) and holds(boxes, -0.22, 0.6, 0.0)
    assert holds(boxes, 0.0, 0.6, 0.17)
    assert (holds(boxes, -0.2, 0.6, -0.25), holds(boxes, 0.2, 0.6, -0.25)) == (left, right)
