"""A policy's steps as movements of AI2-THOR's arm: what they ask for, and what the simulated hand
does."""

import math

import numpy as np
import pytest

from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Vector
from model_adapters import ArmDelta

STILL = (0.0, 0.0, 0.0)


def step(translation=STILL, rotation=STILL, gripper=1.0):
    return ArmDelta(translation, rotation, gripper)


def array_of(vector: Vector):
    return np.array([vector.x, vector.y, vector.z])


@pytest.fixture(scope="module")
def simulator():
    """In the middle of an empty room of four by four metres: nothing is in the arm's way."""
    corners = [{"x": x, "y": 0, "z": z} for x, z in ((0, 0), (0, 4), (4, 4), (4, 0))]
    room = {"id": "room|1", "roomType": "Kitchen", "floorPolygon": corners}
    nothing = {"walls": [], "objects": [], "doors": [], "windows": []}
    house = {"rooms": [room | {"ceilings": [], "children": []}], **nothing}
    house |= {"proceduralParameters": {}}
    with Simulator(embedded_launch(), image=False, instances=False, agentMode="arm") as simulator:
        simulator.reset(house)
        yield simulator


@pytest.fixture
def arm(simulator):
    """Faces a direction with its arm at rest, does steps, and tells of the wrist and of the sphere
    seen from it."""

    class Arm:
        def face(self, rotation):
            simulator.reset(None)
            stand = simulator.view.agent.position
            pose = {"position": {"x": 2.0, "y": stand.y, "z": 2.0}, "rotation": {"y": rotation}}
            full = {"horizon": 0, "standing": True, "forceAction": True}
            view = simulator.step("TeleportFull", **pose, **full)
            assert view.success, view.error
            return self.now()

        def now(self):
            arm = simulator.view.arm
            return array_of(arm.wrist), array_of(arm.sphere_center) - array_of(arm.wrist)

        def does(self, *deltas, conversion=None):
            for delta in deltas:
                for call in (conversion or Conversion()).calls(delta):
                    view = simulator.step(**call)
                    assert view.success, view.error
            return self.now()

    return Arm()


# By hand. Robot: x forward, y left, z up, right-handed. Unity: y up; at 0 degrees the agent looks
# along +z and its left is -x; at 90 degrees it looks along +x and its left is +z.
MOVES = [
    (0, (1, 0, 0), (0, 0, 1)),
    (0, (0, 1, 0), (-1, 0, 0)),
    (0, (0, 0, 1), (0, 1, 0)),
    (90, (1, 0, 0), (1, 0, 0)),
    (90, (0, 1, 0), (0, 0, 1)),
    (90, (0, 0, 1), (0, 1, 0)),
]


@pytest.mark.parametrize("length", [0.08, -0.08], ids=["forth", "back"])
@pytest.mark.parametrize(("facing", "direction", "moved"), MOVES)
def test_a_unit_move_moves_the_hand_along_its_axis_by_its_length(
    arm, facing, direction, moved, length
):
    before, looking = arm.face(facing)
    after, still_looking = arm.does(step(tuple(length * part for part in direction)))
    assert after - before == pytest.approx(length * np.array(moved), abs=1e-4)
    assert still_looking == pytest.approx(looking, abs=1e-4)


# A turn by 0.4 rad about the robot's axes, right-handed, takes the hand's looking direction,
# forward at rest: about z (up) to cos forward + sin left; about y (left) to cos forward + sin down;
# about x (forward) nowhere. (forward, left, up) shares of the looking direction after it:
C, S = math.cos(0.4), math.sin(0.4)
TURNS = [
    ("yaw left", (0, 0, 0.4), (C, S, 0)),
    ("yaw right", (0, 0, -0.4), (C, -S, 0)),
    ("pitch down", (0, 0.4, 0), (C, 0, -S)),
    ("pitch up", (0, -0.4, 0), (C, 0, S)),
    ("roll, left side up", (0.4, 0, 0), (1, 0, 0)),
    ("roll, left side down", (-0.4, 0, 0), (1, 0, 0)),
]


def in_world(shares, facing):
    """A direction of the robot's frame, by the words above."""
    ahead, left, up = shares
    return np.array({0: (-left, up, ahead), 90: (ahead, up, left)}[facing])


@pytest.mark.parametrize("facing", [0, 90])
@pytest.mark.parametrize(
    ("rotation", "looks"), [turn[1:] for turn in TURNS], ids=[turn[0] for turn in TURNS]
)
def test_a_unit_turn_turns_the_hand_about_its_axis_by_its_angle(arm, facing, rotation, looks):
    wrist, looking = arm.face(facing)
    length = math.hypot(*looking)
    assert length == pytest.approx(0.07, abs=1e-4)  # the palm, and the radius of 0.06 m
    assert looking == pytest.approx(length * in_world((1, 0, 0), facing), abs=1e-3)
    after, now = arm.does(step(rotation=rotation))
    assert now == pytest.approx(length * in_world(looks, facing), abs=1e-4)
    assert after == pytest.approx(wrist, abs=1e-3)  # it turns on the spot


@pytest.mark.parametrize("facing", [0, 90])
@pytest.mark.parametrize(("roll", "up"), [(1, S), (-1, -S)])
def test_a_roll_lifts_the_hands_left_side_as_a_right_handed_turn_about_forward_does(
    arm, facing, roll, up
):
    """It shows in where the hand's own left is: a quarter's roll makes that the world's up, or
    down."""
    arm.face(facing)
    _, looking = arm.does(step(rotation=(roll * math.pi / 2, 0, 0)), step(rotation=(0, 0, 0.4)))
    length = math.hypot(*looking)
    assert looking == pytest.approx(length * in_world((C, 0, up), facing), abs=1e-4)


def test_a_step_too_long_is_cut_in_its_direction(arm):
    (call,) = Conversion(max_step=0.1).calls(step((0.3, 0.0, -0.4)))
    assert call["offset"] == pytest.approx({"x": 0.0, "y": -0.08, "z": 0.06})
    before, _ = arm.face(0)
    after, _ = arm.does(step((0.3, 0.0, -0.4)))
    assert after - before == pytest.approx([0, -0.08, 0.06], abs=1e-4)


def test_a_short_step_is_not_cut_and_the_scale_comes_before_the_cut():
    (call,) = Conversion(max_step=0.1).calls(step((0.01, 0.02, 0.02)))
    assert call["offset"] == pytest.approx({"x": -0.02, "y": 0.02, "z": 0.01})
    (call,) = Conversion(translation_scale=2.0, max_step=0.1).calls(step((0.01, 0.02, 0.02)))
    assert call["offset"] == pytest.approx({"x": -0.04, "y": 0.04, "z": 0.02})
    # 0.3 m cut to 0.06.
    (call,) = Conversion(translation_scale=10.0, max_step=0.06).calls(step((0.01, 0.02, 0.02)))
    assert call["offset"] == pytest.approx({"x": -0.04, "y": 0.04, "z": 0.02})


def test_the_scale_is_of_lengths_alone_and_turns_are_told_in_degrees():
    move, turn = Conversion(translation_scale=3.0).calls(step((0.01, 0, 0), (0.1, 0.2, 0.3)))
    assert move["action"] == "MoveArmRelative" and move["offset"]["z"] == pytest.approx(0.03)
    angles = [turn[name] for name in ("roll", "pitch", "yaw")]
    assert angles == pytest.approx([math.degrees(0.1), math.degrees(0.2), -math.degrees(0.3)])


def test_a_turn_is_left_out_where_rotation_is_off():
    assert Conversion(rotation=False).calls(step(rotation=(0.1, 0.2, 0.3))) == []
    (call,) = Conversion(rotation=False).calls(step((0.05, 0, 0), (0.1, 0.2, 0.3)))
    assert call["action"] == "MoveArmRelative"


def test_who_stands_still_asks_for_nothing():
    assert Conversion().calls(step()) == []
    assert Conversion().calls(step((1e-9, 0, 0), (0, 1e-9, 0))) == []


@pytest.mark.parametrize("back", [True, False])
def test_whether_the_arm_goes_back_is_told_with_each_movement(back):
    calls = Conversion(return_to_start=back).calls(step((0.05, 0, 0), (0.1, 0, 0)))
    assert [call["returnToStart"] for call in calls] == [back, back]


@pytest.mark.parametrize(("back", "height"), [(True, 1.0), (False, 0.0)])
def test_an_arm_that_meets_the_floor_goes_back_or_stays_there(arm, simulator, back, height):
    """The scale and the cut of ten metres let one step reach the floor."""
    arm.face(0)
    simulator.step("MoveArmBase", y=0)
    before, _ = arm.now()
    (call,) = Conversion(10.0, 10.0, return_to_start=back).calls(step((0, 0, -0.06)))
    view = simulator.step(**call)
    assert not view.success and view.error.startswith("Collided")
    after, _ = arm.now()
    assert after[1] == pytest.approx(before[1], abs=1e-4) if height else after[1] < before[1] - 0.05
