"""What numbers mean: a known step, coded in every format, is read again."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from infthor_eval.errors import ModelError
from model_adapters.options.policies import GRIPPERS, STATES, SocketPolicyOptions
from model_adapters.remote_policies.actions import Spec, convention_of, state_vector

from .conftest import HAND, refusal

PI = (-3.15, 3.15)
UNIT = (-1, 1)
CODES = {
    "euler_xyz": lambda turn: turn.as_euler("xyz"),
    "axis_angle": lambda turn: turn.as_rotvec(),
    "quaternion_xyzw": lambda turn: turn.as_quat(),
    "rot6d_interleaved": lambda turn: turn.as_matrix()[:, :2].reshape(6),
}
ROTATIONS = [
    *itertools.product(("euler_xyz", "axis_angle"), (PI, UNIT, None)),
    ("quaternion_xyzw", UNIT),
    ("rot6d_interleaved", None),
]
angle = st.floats(-1.4, 1.4)
metre = st.floats(-0.5, 0.5)
scale = st.none() | st.floats(0.01, 2.0)


def specs(position=("delta_xyz", UNIT), rotation=("euler_xyz", PI), gripper="continuous_01"):
    """How a server declares its actions."""
    return {
        "position": Spec(*position),
        "rotation": Spec(*rotation),
        "gripper": Spec(gripper),
    }


def read(actions, declared, **options):
    return convention_of("it", declared, SocketPolicyOptions(**options)).deltas("it", actions)


@given(
    moved=st.tuples(metre, metre, metre),
    turned=st.tuples(angle, angle, angle),
    opening=st.floats(0, 1),
    position=st.sampled_from((UNIT, None)),
    rotation=st.sampled_from(ROTATIONS),
    gripper=st.sampled_from(tuple(GRIPPERS)),
    scales=st.tuples(scale, scale),
    n_steps=st.integers(1, 3),
)
def test_a_step_in_any_format_is_read_as_it_was(
    moved, turned, opening, position, rotation, gripper, scales, n_steps
):
    form, bounds = rotation
    metres = scales[0] or (0.05 if position else 1)
    radians = scales[1] or (0.5 if bounds == UNIT else 1)
    coded = CODES[form](Rotation.from_euler("xyz", turned))
    if form in ("euler_xyz", "axis_angle"):
        coded = coded / radians
    closed, opened = GRIPPERS[gripper]
    row = [*np.divide(moved, metres), *coded, closed + opening * (opened - closed)]
    declared = specs(("delta_xyz", position), rotation, gripper)
    steps = read([row] * n_steps, declared, translation_scale=scales[0], rotation_scale=scales[1])
    assert len(steps) == n_steps
    for step in steps:
        np.testing.assert_allclose(step.translation, moved, atol=1e-9)
        np.testing.assert_allclose(step.rotation, turned, atol=1e-9)
        assert step.gripper == pytest.approx(opening)


@pytest.mark.parametrize("declared", [{}, {"actions": Spec("raw")}])
def test_what_is_not_declared_is_robosuites(declared):
    (step,) = read(np.array([1, 0, -1, 0, 0, 1, 1], dtype=np.float32), declared)
    np.testing.assert_allclose(step.translation, (0.05, 0, -0.05))
    np.testing.assert_allclose(step.rotation, (0, 0, 0.5), atol=1e-12)
    assert step.gripper == 0
    assert read([0] * 6 + [1], declared, gripper="continuous_01")[0].gripper == 1
    assert read([0] * 6 + [7], declared)[0].gripper == 0  # beyond closed


def test_what_the_user_says_comes_before_what_is_declared():
    declared = specs(rotation=("axis_angle", PI), gripper="raw")
    (step,) = read([1, 0, 0, 1, 0, 0, -1], declared, rotation_scale=0.5, gripper="binary_close_01")
    np.testing.assert_allclose(step.rotation, (0.5, 0, 0))
    assert step.gripper == 1
    (step,) = read([1, 0, 0] + [0] * 4, specs(("delta_xyz", (0, 9))), translation_scale=0.5)
    assert step.translation == (0.5, 0, 0)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        (specs(position=("absolute_xyz",)), "declares position absolute_xyz, rotation euler_xyz"),
        (specs(position=("delta_xyz", (-2, 2))), r"translation from -2 to 2.*translation_scale="),
        (specs(rotation=("euler_xyz", (0, 1))), r"rotation from 0 to 1.*rotation_scale=NUMBER"),
        (specs(rotation=("absolute_euler",)), "a rotation must be one of euler_xyz, axis_angle"),
        (specs(gripper="raw"), r"gripper raw; say which it is: gripper=binary_close_positive\|"),
        (specs(gripper="suction"), "gripper suction; say which it is"),
        ({"joints": Spec("joint_positions")}, "declares joints joint_positions; only position"),
        (specs() | {"base_motion": Spec("base_velocity3_torso1")}, "base_motion base_velocity3"),
        (dict(reversed(specs().items())), "declares gripper continuous_01, rotation"),
    ],
)
def test_other_actions_are_refused(declared, message):
    with pytest.raises(ModelError, match=message):
        convention_of("it", declared, SocketPolicyOptions())


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([0.0] * 6, r"shape \[1, 6\], not rows of 7 numbers"),
        ([0.0] * 8, r"shape \[1, 8\]"),
        ([[[0.0] * 7]], r"shape \[1, 1, 7\]"),
        ([], r"shape \[1, 0\]"),
        (np.zeros((0, 7)), r"shape \[0, 7\]"),
        (0.5, r"shape \[1, 1\]"),
        ([float("nan")] * 7, "not finite"),
        ([1e300] * 7, "not finite"),
        (["1"] * 7, "without actions of numbers"),
        ([True] * 7, "without actions of numbers"),
        ([[0.0] * 7, [0.0]], "without actions of numbers"),
        (None, "without actions of numbers"),
        ({"a": 1}, "without actions of numbers"),
    ],
)
def test_what_is_no_action_is_refused(actions, message):
    with pytest.raises(ModelError, match=message):
        read(actions, {})


@pytest.mark.parametrize(
    ("form", "numbers"),
    [
        ("quaternion_xyzw", [0, 0, 0, 0]),
        ("rot6d_interleaved", [0] * 6),
        ("rot6d_interleaved", [1, 2, 0, 0, 1, 2]),
    ],
)
def test_what_is_no_rotation_is_refused(form, numbers):
    said = refusal(read, [0, 0, 0, *numbers, 0], specs(rotation=(form,)))
    assert "gives rotations that are none" in said


def test_numbers_at_the_end_are_left_out_if_they_mean_nothing():
    assert read([0.5] * 7 + [9.0] * 25, {}, padded=True) == read([0.5] * 7, {})
    with pytest.raises(ModelError, match=r"shape \[1, 6\]"):
        read([0.5] * 6, {}, padded=True)


@given(turned=st.tuples(angle, angle, angle), form=st.sampled_from(STATES))
def test_a_hand_is_eight_numbers(turned, form):
    vector = state_vector(replace(HAND, rotation=turned), form)
    assert (vector.shape, vector.dtype) == ((8,), np.float32)
    np.testing.assert_allclose(vector[:3], HAND.position, rtol=1e-6)
    n_gripper = 1 if "quat" in form else 2
    assert vector[-n_gripper:].tolist() == [1.0] * n_gripper
    numbers = vector[3:-n_gripper]
    turn = {
        "euler3": lambda: Rotation.from_euler("xyz", numbers),
        "axisangle3": lambda: Rotation.from_rotvec(numbers),
        "quat4": lambda: Rotation.from_quat(numbers),
    }[form.split("_")[2]]()
    np.testing.assert_allclose(turn.as_euler("xyz"), turned, atol=1e-5)
