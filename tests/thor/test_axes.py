import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.thor.restore import _angles, _matrix, modern_rotation

angles = st.fixed_dictionaries(dict.fromkeys("xyz", st.floats(-360, 360)))


@given(angles)
def test_angles_of_a_matrix_give_the_matrix_again(rotation):
    matrix = _matrix(rotation)
    assert np.allclose(_matrix(_angles(matrix)), matrix, atol=1e-5)


@given(angles)
def test_a_thing_that_did_not_change_keeps_its_rotation(rotation):
    assert modern_rotation("Mug", rotation) == rotation


@pytest.mark.parametrize(("object_type", "turn"), [("Knife", 90.0), ("Spatula", 270.0)])
def test_a_thing_that_lies_flat_is_turned_about_the_vertical(object_type, turn):
    turned = modern_rotation(object_type, {"x": 0.0, "y": 30.0, "z": 0.0})
    assert turned == pytest.approx({"x": 0.0, "y": 30.0 + turn, "z": 0.0}, abs=1e-5)


def test_a_thing_that_stands_is_turned_about_its_own_axis():
    standing = {"x": 90.0, "y": 0.0, "z": 0.0}
    turned = modern_rotation("Knife", standing)
    assert np.allclose(_matrix(turned)[:, 1], _matrix(standing)[:, 1], atol=1e-5)
