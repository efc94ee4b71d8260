"""The arm's joints: what inverse kinematics bends, forward kinematics finds again."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_sim.arm.kinova import LINK, SHOULDER, Kinova, forward, inverse
from infthor_sim.arm.paths import path_distances, rotation_steps
from infthor_sim.arm.rig import ArmPose
from infthor_sim.arm.stretch import Stretch
from infthor_sim.geometry import axis_angle, axis_rotation, euler_matrix

UNIT = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)
ANGLE = st.floats(-720, 720)
REACH = 2 * LINK


def solved(target: np.ndarray, elbow: float) -> tuple[np.ndarray, np.ndarray]:
    turns = inverse(target[None], np.array([elbow]))
    return turns[0], forward(turns)[0]


@given(direction=UNIT, share=st.floats(0, 1), elbow=ANGLE)
def test_forward_after_inverse_is_the_target(direction, share, elbow):
    target = SHOULDER + direction / np.linalg.norm(direction) * share * REACH
    turns, joints = solved(target, elbow)
    assert np.linalg.norm(joints[3] - target) < 1e-3
    assert np.linalg.norm(np.diff(joints, axis=0), axis=1) == pytest.approx([LINK] * 3)
    for turn in turns:
        assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-9)
        assert np.linalg.det(turn) == pytest.approx(1)


@given(direction=UNIT, distance=st.floats(REACH, 1e6), elbow=ANGLE)
def test_beyond_its_reach_the_arm_is_stretched_out_towards_the_target(direction, distance, elbow):
    ahead = direction / np.linalg.norm(direction)
    _, joints = solved(SHOULDER + ahead * distance, elbow)
    assert joints[3] - SHOULDER == pytest.approx(ahead * REACH, abs=1e-6)


@given(direction=UNIT, share=st.floats(0.05, 0.95), elbow=ANGLE, turn=st.floats(1, 179))
def test_the_elbow_turns_about_the_line_from_shoulder_to_wrist(direction, share, elbow, turn):
    target = SHOULDER + direction / np.linalg.norm(direction) * share * REACH
    (_, before), (_, after) = solved(target, elbow), solved(target, elbow + turn)
    line = (target - SHOULDER) / np.linalg.norm(target - SHOULDER)
    first = before[2] - SHOULDER - line * (line @ (before[2] - SHOULDER))
    second = after[2] - SHOULDER - line * (line @ (after[2] - SHOULDER))
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    assert cosine == pytest.approx(np.cos(np.radians(turn)), abs=1e-6)


@given(st.tuples(*[st.floats(-1.5, 1.5)] * 3).map(np.array))
def test_the_stretch_robot_reaches_what_is_within_its_limits(target):
    rig = Stretch()
    (pose,) = rig.reach([rig.rest()], target[None])
    assert pose.wrist[0] == 0 and -0.056 <= pose.wrist[1] <= 1.045 and 0 <= pose.wrist[2] <= 0.516
    (again,) = rig.reach([rig.rest()], pose.wrist[None])
    assert again.wrist == pytest.approx(pose.wrist)


@pytest.mark.parametrize("rig", [Kinova(), Stretch()])
def test_many_poses_at_once_are_each_alone(rig):
    poses = rig.reach(
        [rig.rest()] * 3, np.array([[0.0, 0.1, 0.5], [0.1, 0.4, 0.3], [0.0, -0.3, 0.6]])
    )
    together = rig.boxes(poses)
    for index, pose in enumerate(poses):
        alone = rig.boxes([pose])
        assert together.center[index] == pytest.approx(alone.center[0])
        assert together.half[index] == pytest.approx(alone.half[0])
        assert together.axes[index] == pytest.approx(alone.axes[0])
    assert len(rig.joint_names) == rig.joints(poses).positions.shape[1]


@pytest.mark.parametrize(
    ("line", "allowed"),
    [((0, 0, 0.63), True), ((0.6, 0.1, 0), True), ((0, 0, 0.633), False), ((0, 0, -0.01), False)],
)
def test_restricted_movements_have_a_front_and_a_reach(line, allowed):
    assert Kinova().allows(SHOULDER + np.array(line)) == allowed


@given(st.tuples(*[st.floats(-180, 180)] * 3))
def test_axis_and_angle_give_the_same_rotation(angles):
    turn = euler_matrix(angles)
    axis, degrees = axis_angle(turn)
    assert axis_rotation(axis, degrees) == pytest.approx(turn, abs=1e-5)
    steps = rotation_steps(turn, 5.0)
    assert steps[-1] is turn
    for before, after in zip([np.eye(3), *steps], steps, strict=False):
        assert axis_angle(before.T @ after)[1] <= 5.0 + 1e-3


@given(st.floats(0, 1e9))
def test_long_paths_are_checked_in_few_steps(distance):
    steps = path_distances(distance)
    assert len(steps) < 400
    assert steps[-1] == pytest.approx(distance)
    assert (np.diff(steps) > -1e-9).all()
    assert (np.diff(steps[steps <= 1.0]) <= 0.02 + 1e-9).all()


def test_a_pose_keeps_its_wrist_s_rotation_when_it_reaches():
    turn = euler_matrix((10, 20, 30))
    (pose,) = Kinova().reach([ArmPose(SHOULDER, turn, 0.2, 5.0)], np.array([[0.1, 0.1, 0.5]]))
    assert (pose.turn is turn, pose.base, pose.elbow) == (True, 0.2, 5.0)
