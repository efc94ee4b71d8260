"""How far apart turned boxes are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_sim.arm.boxes import Boxes, join, separations, sphere_gaps
from infthor_sim.geometry import euler_matrix

POINT = st.tuples(*[st.floats(-0.5, 0.5)] * 3).map(np.array)
SIZE = st.tuples(*[st.floats(0.01, 0.4)] * 3).map(np.array)
ANGLES = st.tuples(*[st.floats(-180, 180)] * 3)
GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 7)] * 3), axis=-1).reshape(-1, 3)


@st.composite
def boxes(draw: st.DrawFn) -> Boxes:
    axes = euler_matrix(draw(ANGLES)).T
    return Boxes(draw(POINT)[None], axes[None], draw(SIZE)[None])


def inside(points: np.ndarray, box: Boxes) -> np.ndarray:
    return (np.abs((points - box.center[0]) @ box.axes[0].T) < box.half[0] - 1e-9).all(axis=1)


@given(boxes(), boxes())
def test_boxes_that_share_a_point_overlap(first, second):
    points = first.center[0] + (GRID * first.half[0]) @ first.axes[0]
    gap = separations(first, second)[0, 0]
    assert separations(second, first)[0, 0] == pytest.approx(gap)
    if inside(points, second).any():
        assert gap < 0


@given(boxes(), boxes())
def test_boxes_that_overlap_are_apart_once_moved_as_far_as_they_do(first, second):
    gap = separations(first, second)[0, 0]
    if not np.isfinite(gap) or gap >= 0:
        points = first.center[0] + (GRID * first.half[0]) @ first.axes[0]
        assert not inside(points, second).any()
        return
    away = np.array([
        separations(Boxes(first.center + direction * (1e-6 - gap), first.axes, first.half),
                    second)[0, 0]
        for direction in [*directions(first, second), *-directions(first, second)]
    ])  # fmt: skip
    assert away.max() >= 0


def directions(first: Boxes, second: Boxes) -> np.ndarray:
    edges = np.cross(first.axes[0][:, None], second.axes[0][None]).reshape(-1, 3)
    lengths = np.linalg.norm(edges, axis=1)
    return np.concatenate(
        [first.axes[0], second.axes[0], edges[lengths > 1e-4] / lengths[lengths > 1e-4, None]]
    )


@given(boxes(), POINT, st.floats(0.01, 0.3))
def test_a_sphere_meets_a_box_that_has_a_point_in_it(box, center, radius):
    points = box.center[0] + (GRID * box.half[0]) @ box.axes[0]
    nearest = np.linalg.norm(points - center, axis=1).min()
    gap = sphere_gaps(box, center)[0]
    assert gap <= nearest + 1e-9
    assert (gap <= radius) or (nearest > radius)


@given(st.lists(boxes(), min_size=1, max_size=4), st.lists(boxes(), min_size=1, max_size=4))
def test_pairs_in_bulk_are_as_pairs_alone(first, second):
    together = separations(join(first), join(second))
    for row, one in enumerate(first):
        for column, other in enumerate(second):
            assert together[row, column] == pytest.approx(separations(one, other)[0, 0])
