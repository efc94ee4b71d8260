"""Moving the arm and walking with it: arguments, spaces, collisions and their messages."""

import numpy as np
import pytest

from infthor_sim.actions.arm_motion import obstacles
from infthor_sim.arm.boxes import separations

from ..harness import Bench
from .harness import arm_bench, own_boxes, wrist, xyz

JOINT = {"name", "position", "rootRelativePosition", "rotation", "rootRelativeRotation",
         "localRotation",
         "armBaseHeight", "elbowOrientation"}  # fmt: skip


@pytest.fixture
def bench() -> Bench:
    new = arm_bench()
    new.ok("MoveArmBase", y=0.8)
    return new


def arm(bench: Bench) -> dict:
    return bench.metadata["arm"]


def relative(bench: Bench) -> list[float]:
    return list(arm(bench)["joints"][-1]["rootRelativePosition"].values())


def test_the_arm_at_rest():
    bench = arm_bench()
    joints = arm(bench)["joints"]
    assert [j["name"] for j in joints] == [f"robot_arm_{n}_jnt" for n in range(1, 5)]
    assert all(set(j) == JOINT for j in joints)
    assert relative(bench) == [0, 0, 0.4]
    assert joints[0]["armBaseHeight"] == -0.003 and joints[0]["elbowOrientation"] == 0
    assert joints[1]["armBaseHeight"] is None
    assert joints[3]["rootRelativeRotation"] == {"x": 1, "y": 0, "z": 0, "w": 0}
    assert arm(bench)["heldObjects"] == [] and arm(bench)["handSphereRadius"] == 0.06
    assert bench.metadata["inventoryObjects"] == []


def test_positions_in_the_three_spaces_are_the_same_place(bench):
    bench.ok("MoveArm", position={"x": 0.1, "y": 0.1, "z": 0.5})
    assert relative(bench) == pytest.approx([0.1, 0.1, 0.5], abs=1e-5)
    there = wrist(bench)
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.6})
    bench.ok("MoveArm", position=xyz(there), coordinateSpace="world")
    assert relative(bench) == pytest.approx([0.1, 0.1, 0.5], abs=1e-5)
    bench.ok("MoveArm", position={"x": 0, "y": 0.05, "z": 0}, coordinateSpace="wrist")
    assert relative(bench) == pytest.approx([0.1, 0.15, 0.5], abs=1e-5)
    bench.ok("MoveArmRelative", offset={"x": -0.1})
    bench.ok("MoveArmRelative", offset={"y": -0.05}, coordinateSpace="world")
    assert relative(bench) == pytest.approx([0, 0.1, 0.5], abs=1e-5)
    assert "Invalid coordinateSpace: room" in bench.refused(
        "MoveArm", position={"x": 0}, coordinateSpace="room"
    )


def test_wrist_space_turns_with_the_wrist(bench):
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.5})
    bench.ok("RotateWristRelative", yaw=90)
    bench.ok("MoveArmRelative", offset={"z": 0.1}, coordinateSpace="wrist")
    assert relative(bench) == pytest.approx([0.1, 0, 0.5], abs=1e-5)
    rotation = arm(bench)["joints"][-1]["rootRelativeRotation"]
    assert rotation == pytest.approx({"x": 0, "y": 1, "z": 0, "w": 90}, abs=1e-4)


def test_the_sphere_begins_at_the_palm_whatever_its_radius(bench):
    bench.ok("RotateAgent", degrees=-bench.metadata["agent"]["rotation"]["y"])
    for radius in (0.04, 0.2, 0.5):
        bench.ok("SetHandSphereRadius", radius=radius)
        center = np.array(list(arm(bench)["handSphereCenter"].values()))
        assert center - wrist(bench) == pytest.approx([0, 0, 0.01 + radius], abs=1e-5)
    for radius in (0.039, 0.51):
        assert "cannot be less than 0.04m nor greater than 0.5m" in bench.refused(
            "SetHandSphereRadius", radius=radius
        )


def test_beyond_reach_the_arm_is_stretched_out_unless_restricted(bench):
    bench.ok("MoveArm", position={"x": 0.0, "y": 0.2, "z": 1.4})
    line = np.array(relative(bench)) - (0, 0, 0.31675)
    assert np.linalg.norm(line) == pytest.approx(0.6335, abs=1e-5)
    message = bench.refused("MoveArm", position={"x": 0, "y": 0.2, "z": 1.4}, restrictMovement=True)
    place = "Position '(0.00, 0.20, 1.40)' in space 'armBase'"
    assert message == f"Invalid target: {place} is behind shoulder."
    bench.refused("MoveArm", position={"x": 0, "y": 0, "z": 0.2}, restrictMovement=True)
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.9}, restrictMovement=True)


def test_the_base_s_height_is_a_share_of_its_range_or_metres():
    bench = arm_bench()
    bench.ok("MoveArmBase", y=1.0)
    assert arm(bench)["joints"][0]["position"]["y"] == pytest.approx(1.801, abs=1e-3)
    bench.ok("MoveArmBase", y=1.2, normalizedY=False)
    assert arm(bench)["joints"][0]["position"]["y"] == pytest.approx(1.2)
    assert "must be in [0, 1] when normalizedY=true" in bench.refused("MoveArmBase", y=1.1)
    assert "value must be in [0.450999, 1.801]" in bench.refused(
        "MoveArmBase", y=1.9, normalizedY=False
    )
    bench.ok("MoveArmBaseUp", distance=5)
    assert arm(bench)["joints"][0]["position"]["y"] == pytest.approx(1.801, abs=1e-3)
    bench.ok("MoveArmBaseDown", distance=0.2)
    assert arm(bench)["joints"][0]["position"]["y"] == pytest.approx(1.601, abs=1e-3)


def test_the_elbow_turns_relatively_and_absolutely(bench):
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.6})
    before = wrist(bench)
    bench.ok("RotateElbowRelative", degrees=30)
    bench.ok("RotateElbowRelative", degrees=-50)
    assert arm(bench)["joints"][0]["elbowOrientation"] == pytest.approx(340)
    bench.ok("RotateElbow", degrees=20)
    assert arm(bench)["joints"][0]["elbowOrientation"] == pytest.approx(20)
    assert wrist(bench) == pytest.approx(before, abs=1e-6)


def test_the_wrist_turns_around_a_point_and_comes_back(bench):
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.6})
    before, point = wrist(bench), wrist(bench) + np.array([0.0, 0.1, 0.0])
    bench.ok("RotateWristAroundPoint", point=xyz(point), pitch=40)
    assert np.linalg.norm(wrist(bench) - point) == pytest.approx(0.1, abs=1e-5)
    assert np.linalg.norm(wrist(bench) - before) > 0.05
    bench.ok("RotateWristAroundPoint", point=xyz(point), pitch=-40)
    assert wrist(bench) == pytest.approx(before, abs=1e-5)
    assert "holding != 1 objects, currently holding 0" in bench.refused(
        "RotateWristAroundHeldObject", yaw=10
    )


def facing(bench: Bench, kind: str) -> None:
    """The agent before the middle of a piece of furniture, 0.6 m from its front."""
    item = bench.sim.world.objects[bench.first(kind)]
    low, high = item.bounds()
    middle = (low + high) / 2
    cells = [c for c in bench.sim.world.nav if abs(c[0] - middle[0]) < 0.3]
    x, z = min(cells, key=lambda c: abs(c[1] - middle[2]))
    bench.teleport(x, z, 0 if z < middle[2] else 180)


@pytest.mark.parametrize("back", [True, False])
def test_a_collision_names_what_is_in_the_way(bench, back):
    facing(bench, "CounterTop")
    bench.ok("MoveArmBase", y=1.2, normalizedY=False)
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.7})
    before = wrist(bench)
    message = bench.refused("MoveArmBase", y=0.1, returnToStart=back)
    assert message.startswith("Collided with static sim object: 'CounterTop_")
    assert ", could not reach target: '(" in message
    fallen = before[1] - wrist(bench)[1]
    assert fallen == 0 if back else 0.1 < fallen < 1.0
    if not back:  # it stands just above the counter, and may go up again
        bench.refused("MoveArmBaseDown", distance=0.05)
        bench.ok("MoveArmBaseUp", distance=0.05)


def test_walls_are_structures():
    bench = arm_bench()
    low, _ = bench.sim.world.scene_bounds()
    bench.ok("MoveArmBase", y=1)
    world = bench.sim.world
    world.agent.position[[0, 2]] = (0.0, low[2] + 0.7)
    bench.ok("RotateAgent", degrees=180 - bench.metadata["agent"]["rotation"]["y"])
    message = bench.refused("MoveArm", position={"x": 0, "y": 0, "z": 0.8})
    assert message.startswith(
        "Collided with static structure in scene: 'Wall', could not reach target: "
    )
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.6})


def test_what_is_touched_already_does_not_lock_the_arm():
    bench = arm_bench()
    facing(bench, "CounterTop")
    world = bench.sim.world
    world.arm.change(world.arm.rig.with_lift(world.arm.pose, -0.1))
    world.agent.position[2] += 0.3  # the hand and a link are in the counter now
    assert separations(own_boxes(bench), obstacles(bench.sim).boxes).min() < -0.02
    bench.ok("MoveBack", moveMagnitude=0.45)
    bench.ok("MoveArmBase", y=1.2, normalizedY=False)


def test_the_agent_walks_off_the_grid_until_its_body_or_arm_meets_something(bench):
    start = np.array(list(bench.metadata["agent"]["position"].values()))
    bench.ok("MoveAgent", ahead=0.07, right=0.02)
    bench.ok("MoveBack", moveMagnitude=0.07)
    bench.ok("MoveLeft", moveMagnitude=0.02)
    end = np.array(list(bench.metadata["agent"]["position"].values()))
    assert end == pytest.approx(start, abs=1e-5)
    assert bench.refused("MoveAgent") == "Must specify ahead or right!"
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.9})
    hand = wrist(bench)
    message = bench.refused("MoveAhead", moveMagnitude=20, returnToStart=False)
    assert message.startswith("Collided with static ")
    walked = np.linalg.norm(wrist(bench) - hand)
    assert 0.05 < walked < 10
    low, high = own_boxes(bench).bounds()
    inside = bench.sim.world.scene_bounds()
    assert (low > inside[0] - 0.01).all() and (high < inside[1] + 0.01).all()


def test_turning_swings_the_arm(bench):
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.5})
    before, at = wrist(bench), np.array(list(bench.metadata["agent"]["position"].values()))
    bench.ok("RotateAgent", degrees=45)
    bench.ok("RotateRight", degrees=45)
    turned = wrist(bench) - at
    assert [turned[0], turned[2]] == pytest.approx(
        [before[2] - at[2], -(before[0] - at[0])], abs=1e-5
    )
    bench.ok("RotateLeft")
    assert wrist(bench) == pytest.approx(before, abs=1e-5)


def test_actions_belong_to_modes():
    default = Bench.at("kitchen-1", size=20)
    default.step("MoveArm", position={"x": 0, "y": 0, "z": 0.5})
    assert (default.metadata["errorMessage"], default.metadata["errorCode"]) == (
        "Invalid action: MoveArm",
        "InvalidAction",
    )
    bench = arm_bench()
    assert "isn't holding anything" in bench.refused("PutObject", bench.first("CounterTop"))
    message = bench.refused("PickupObject", bench.first("Apple"))
    assert (
        message == "You are passing in iTHOR PickupObject parameters (objectId) to the arm agent!"
    )
    assert bench.refused("PickupObject") == "No objects were valid to be picked up by the arm"
    bench.step("RotateElbowRelative")
    assert bench.metadata["errorCode"] == "MissingArguments"
    bench.force("OpenObject", bench.first("Fridge"))
    bench.ok("Initialize", agentMode="default")
    assert bench.metadata["arm"] is None


def test_the_mass_threshold_must_be_positive(bench):
    assert "massThreshold must have nonzero value" in bench.refused(
        "Initialize", agentMode="arm", massThreshold=0
    )


def test_a_saved_state_has_the_arm(bench):
    bench.ok("MoveArm", position={"x": 0.1, "y": 0.1, "z": 0.5})
    bench.ok("SaveState")
    before = bench.ok("Pass")["arm"]
    bench.ok("MoveArm", position={"x": 0, "y": 0, "z": 0.7})
    bench.ok("SetHandSphereRadius", radius=0.2)
    assert bench.ok("RestoreState")["arm"] == before


@pytest.mark.parametrize("camera", ["agent", "third"])
def test_the_arm_is_in_the_picture_and_hides_nothing(camera):
    from infthor_sim.player.fifo import FieldType

    bench = Bench.at("kitchen-1", fieldOfView=90, size=100)
    bench.ok(
        "AddThirdPartyCamera",
        position={"x": 0, "y": 2.2, "z": 0},
        rotation={"x": 90, "y": 0, "z": 0},
        fieldOfView=90,
    )
    field = FieldType.RGB if camera == "agent" else FieldType.THIRD_PARTY_RGB
    bench.ok("LookDown", degrees=30)
    seen = {o["objectId"] for o in bench.metadata["objects"] if o["visible"]}
    without = bench.frames[field]
    bench.ok(
        "Initialize", agentMode="arm", fieldOfView=90, visibilityDistance=1.5, fastActionEmit=False
    )
    assert bench.frames[field] != without
    assert {o["objectId"] for o in bench.metadata["objects"] if o["visible"]} == seen


def test_the_arm_is_put_into_a_pose_at_once(bench):
    bench.ok("TeleportArm", position={"x": 0.1, "y": 0.1, "z": 0.5},
             rotation={"x": 0, "y": 2, "z": 0, "w": 90},
             armHeight=0.5, elbowOrientation=-10)  # fmt: skip
    joints = arm(bench)["joints"]
    assert relative(bench) == pytest.approx([0.1, 0.1, 0.5], abs=1e-5)
    assert (joints[0]["armBaseHeight"], joints[0]["elbowOrientation"]) == (0.5, 350)
    assert joints[3]["rootRelativeRotation"] == pytest.approx(
        {"x": 0, "y": 1, "z": 0, "w": 90}, abs=1e-4
    )
    there = wrist(bench)
    bench.ok("TeleportArm")
    assert relative(bench) == [0, 0, 0.4] and arm(bench)["joints"][0]["armBaseHeight"] == -0.003
    bench.ok("TeleportArm", position=xyz(there), worldRelative=True, armHeight=0.5)
    assert wrist(bench) == pytest.approx(there, abs=1e-5)
    message = "collision detected at desired transform, cannot teleport"
    assert (
        bench.refused("TeleportArm", position={"x": 0, "y": -0.6, "z": 0.4}, armHeight=-0.45)
        == message
    )
    bench.force("TeleportArm", position={"x": 0, "y": -0.6, "z": 0.4}, armHeight=-0.45)
    assert "axis" in bench.refused("TeleportArm", rotation={"w": 10})
