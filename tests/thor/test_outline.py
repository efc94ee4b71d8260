import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.thor.outline import shares_in_frame
from infthor_eval.thor.view import Box, Camera, Vector
from infthor_sim.geometry import euler_matrix

SQUARE = (100, 100)


def camera(rotation=0.0, horizon=0.0, angle=90.0):
    return Camera(Vector(1.0, 1.5, 2.0), rotation, horizon, angle)


def box(x, y, z, *size):
    return Box(Vector(x, y, z), Vector(*size))


@pytest.mark.parametrize(
    ("where", "size", "shares"),
    [
        ((1.0, 1.5, 4.0), (0.2, 0.2, 0.2), (1.0, 1.0)),
        ((1.0, 1.5, 0.0), (0.2, 0.2, 0.2), (0.0, 0.0)),  # behind the camera
        ((2.99, 1.5, 4.0), (0.7, 0.2, 0.0), (4 / 7, 4 / 7)),  # its middle is at the right edge
        ((1.0, 3.55, 4.0), (0.1, 0.6, 0.0), (3 / 7, 0.0)),  # its top is above the frame
        ((1.0, -0.45, 4.0), (0.1, 0.6, 0.0), (4 / 7, 1.0)),  # only its foot is below it
    ],
)
def test_what_is_cut_off_by_the_frame_does_not_count(where, size, shares):
    assert shares_in_frame(box(*where, *size), camera(), *SQUARE) == pytest.approx(shares, abs=0.01)


@given(
    st.floats(0, 360), st.floats(-30, 60), st.floats(40, 100),
    st.tuples(*[st.floats(-2, 2)] * 3), st.tuples(*[st.floats(0.1, 1)] * 3),
)  # fmt: skip
def test_it_is_the_share_of_points_whose_rays_hit_the_frame(rotation, horizon, angle, at, size):
    lens = camera(rotation, horizon, angle)
    share, _ = shares_in_frame(box(*at, *size), lens, 300, 200)
    random = np.random.default_rng(1)
    points = np.array(at) + random.uniform(-0.5, 0.5, (4000, 3)) * size
    local = (points - (1.0, 1.5, 2.0)) @ euler_matrix((horizon, rotation, 0.0))
    slope = np.tan(np.radians(angle) / 2) * local[:, 2]
    inside = (np.abs(local[:, 0]) <= 1.5 * slope) & (np.abs(local[:, 1]) <= slope)
    assert share == pytest.approx(inside.mean(), abs=0.2)  # by a grid of seven points a side
