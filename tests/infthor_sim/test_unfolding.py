"""What opening does to the boxes of things without doors or drawers, by hand."""

import numpy as np
import pytest

from infthor_sim.objects import default_object
from infthor_sim.physics.clearance import occupant
from infthor_sim.render.primitives import CENTER, HALF, rows
from infthor_sim.render.shapes import shape

from .harness import Bench

STARTS_OPEN = ("Laptop", "Box")
# size when closed, size when wide open, and the side of the box that stays
CASES = {
    "Laptop": ((0.40, 0.03, 0.30), (0.40, 0.30, 0.30), ("low", 1)),
    "Box": ((0.43 * 0.82, 0.29, 0.43 * 0.82), (0.43, 0.29, 0.43), ("low", 1)),
    "Book": ((0.22, 0.03, 0.30), (0.44, 0.015, 0.30), ("high", 0)),
    "Blinds": ((1.01, 0.20, 0.03), (1.01, 0.95, 0.03), ("high", 1)),
    "ShowerCurtain": ((0.43, 1.94, 0.37), (1.53, 1.94, 0.37), ("low", 0)),
}


@pytest.fixture
def bench() -> Bench:
    new = Bench.at("bedroom-1", size=40)
    return new


def box(bench: Bench, object_id: str) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array(bench.object(object_id)["axisAlignedBoundingBox"]["cornerPoints"])
    return corners.min(axis=0), corners.max(axis=0)


@pytest.mark.parametrize("kind", CASES)
def test_boxes_change_with_openness_and_back(bench, kind):
    closed, opened, (end, axis) = CASES[kind]
    item = default_object(kind, np.array([0.0, 1.2, 0.0]))
    bench.sim.world.add(item)
    target = item.object_id
    assert (item.state.openness > 0) == (kind in STARTS_OPEN)
    if kind in STARTS_OPEN:
        bench.force("CloseObject", target)
    else:
        bench.ok("Pass")
    before = [item.box_center.copy(), item.box_size.copy()]
    shut = box(bench, target)
    assert shut[1] - shut[0] == pytest.approx(closed, abs=2e-4)
    for openness in (1.0, 0.5, 0.3):
        bench.force("OpenObject", target, openness=openness)
        now = box(bench, target)
        expected = np.array(closed) + openness * (np.array(opened) - closed)
        assert now[1] - now[0] == pytest.approx(expected, abs=3e-4)
        side = 0 if end == "low" else 1
        assert now[side][axis] == pytest.approx(shut[side][axis], abs=2e-4)
        oriented = bench.object(target)["objectOrientedBoundingBox"]
        if oriented is not None:
            assert np.ptp(oriented["cornerPoints"], axis=0) == pytest.approx(expected, abs=3e-4)
    bench.force("CloseObject", target)
    assert item.box_center == pytest.approx(before[0], abs=1e-9)
    assert item.box_size == pytest.approx(before[1], abs=1e-9)


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("front", [0.0, 90.0, 180.0, 270.0])
def test_the_picture_fills_the_box_and_no_more(bench, kind, front):
    item = default_object(kind, np.array([0.0, 1.2, 0.0]))
    item.front = front
    bench.sim.world.add(item)
    for openness in (0.5, 1.0):
        bench.step("CloseObject", item.object_id, forceAction=True)
        for _ in range(2):  # closed, then open
            parts = rows(shape(item), item.position, item.matrix, 0)
            low, high = item.bounds()
            centers = parts[:, CENTER : CENTER + 3]
            assert (centers > low - 0.012).all()
            assert (centers < high + 0.012).all()
            assert (2 * parts[:, HALF : HALF + 3].max() <= 1.15 * max(item.box_size)).all()
            bench.step("OpenObject", item.object_id, openness=openness, forceAction=True)


def test_an_open_laptop_takes_the_room_above_it(bench):
    laptop = default_object("Laptop", np.array([0.0, 1.2, 0.0]))
    pen = default_object("Pen", np.array([0.0, 1.2, 0.0]))
    for item in (laptop, pen):
        bench.sim.world.add(item)
    pen.place_bottom(np.array([0.0, 1.35, 0.0]))
    assert occupant(bench.sim.world, pen) == laptop.name
    bench.force("CloseObject", laptop.object_id)
    assert occupant(bench.sim.world, pen) != laptop.name


@pytest.mark.parametrize(("kind", "share"), [("Kettle", 0.4), ("LaundryHamper", 1.0)])
def test_a_lid_stands_up_while_it_is_open(bench, kind, share):
    item = default_object(kind, np.array([0.0, 1.2, 0.0]))
    bench.sim.world.add(item)
    bench.ok("Pass")
    shut = box(bench, item.object_id)
    for openness in (1.0, 0.5):
        bench.force("OpenObject", item.object_id, openness=openness)
        low, high = box(bench, item.object_id)
        rise = share * item.front_size[2] * np.sin(np.radians(85 * openness))
        assert low == pytest.approx(shut[0], abs=2e-4)
        assert high - shut[1] == pytest.approx([0, rise, 0], abs=2e-4)
        oriented = np.array(
            bench.object(item.object_id)["objectOrientedBoundingBox"]["cornerPoints"]
        )
        assert np.ptp(oriented, axis=0) == pytest.approx(high - low, abs=3e-4)
    bench.force("CloseObject", item.object_id)
    assert np.array(box(bench, item.object_id)) == pytest.approx(np.array(shut), abs=1e-9)
