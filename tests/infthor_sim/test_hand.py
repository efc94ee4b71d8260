"""Moving, turning and letting go of what the agent holds."""

import numpy as np
import pytest

from .harness import Bench


@pytest.fixture
def bench() -> Bench:
    new = Bench.at("kitchen-1", size=40)
    new.ok("RotateLook", rotation={"y": 180})
    new.force("PickupObject", new.first("SoapBottle"))
    return new


def change(bench: Bench, before: dict, pose: str) -> list[float]:
    now = bench.metadata["heldObjectPose"][pose]
    return [now[axis] - before[pose][axis] for axis in "xyz"]


def test_the_pose_of_a_full_hand(bench):
    held = bench.metadata["heldObjectPose"]
    assert bench.metadata["hand"] == held
    assert held["localRotation"] == {"x": 0, "y": 0, "z": 0}
    assert held["localPosition"] == {"x": 0, "y": -0.16, "z": 0.38}


@pytest.mark.parametrize("horizon", [0, 30, -30])
def test_an_empty_hand_is_level_where_a_full_one_rests(bench, horizon):
    bench.ok("RotateLook", rotation={"y": 90}, horizon=horizon)
    full = bench.metadata["heldObjectPose"]
    bench.ok("MoveHeldObject", ahead=0.1, forceVisible=True)
    bench.ok("DropHeldObject")
    empty = bench.metadata["heldObjectPose"]
    assert bench.metadata["hand"] == empty
    assert empty["localRotation"] == {"x": -horizon % 360, "y": 0, "z": 0}
    assert empty["rotation"] == {"x": 0, "y": 90, "z": 0}
    for pose in ("position", "localPosition"):
        assert empty[pose] == full[pose]


def test_an_object_can_be_teleported_from_the_hand_and_picked_up_again(bench):
    """As scripts of rearrangement do, which check that the empty hand is where it usually is."""
    bottle = bench.metadata["inventoryObjects"][0]["objectId"]
    pose = {"position": {"x": 0, "y": 1.5, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0}}
    bench.ok("TeleportObject", objectId=bottle, **pose, forceAction=True, forceKinematic=True,
             allowTeleportOutOfHand=True)  # fmt: skip
    assert bench.metadata["inventoryObjects"] == []
    assert bench.metadata["hand"]["localPosition"] == {"x": 0, "y": -0.16, "z": 0.38}
    bench.force("PickupObject", bottle)


def test_the_hand_of_an_arm_agent_is_zero():
    bench = Bench(size=20)
    pose = bench.reset("kitchen-1", agentMode="arm")["heldObjectPose"]
    assert pose == {part: {"x": 0, "y": 0, "z": 0} for part in pose}


@pytest.mark.parametrize(
    ("action", "arguments", "step"),
    [
        ("MoveHeldObject", {"ahead": 0.1}, [0, 0, 0.1]),
        ("MoveHeldObject", {"ahead": 0.1, "right": 0.05, "up": 0.1}, [0.05, 0.1, 0.1]),
        ("MoveHeldObjectUp", {"moveMagnitude": 0.1}, [0, 0.1, 0]),
        ("MoveHeldObjectLeft", {"moveMagnitude": 0.05}, [-0.05, 0, 0]),
        ("MoveHandAhead", {"moveMagnitude": 0.05}, [0, 0, 0.05]),
    ],
)
def test_moves_in_the_camera_s_frame(bench, action, arguments, step):
    before = bench.metadata["heldObjectPose"]
    bench.ok(action, **arguments)
    assert change(bench, before, "localPosition") == pytest.approx(step, abs=1e-5)
    assert change(bench, before, "rotation") == [0, 0, 0]


def test_out_of_reach_and_view_are_refused(bench):
    assert "out of range" in bench.refused("MoveHeldObject", ahead=5)
    assert "Viewport" in bench.refused("MoveHeldObject", right=0.8)
    bench.ok("MoveHeldObject", right=0.8, forceVisible=True)


def test_walls_stop_the_hand(bench):
    low, _ = bench.sim.world.scene_bounds()
    bench.sim.world.agent.position[2] = low[2] + 0.45
    bench.ok("Pass")
    bench.sim.world.carry()
    assert "Wall is blocking" in bench.refused("MoveHeldObject", ahead=0.3, forceVisible=True)


@pytest.mark.parametrize(
    ("turn", "difference"),
    [({"pitch": 90}, [90, 0, 0]), ({"yaw": 90}, [0, 90, 0]), ({"roll": 90}, [0, 0, 270])],
)
def test_turns_about_its_own_axes(bench, turn, difference):
    before = bench.metadata["heldObjectPose"]
    bench.ok("RotateHeldObject", **turn)
    assert change(bench, before, "rotation") == difference
    assert change(bench, before, "position") == pytest.approx([0, 0, 0], abs=1e-6)


def test_three_turns_at_once_are_reported_as_by_unity(bench):
    bench.ok("RotateHeldObject", pitch=90, yaw=90, roll=90)
    assert bench.metadata["hand"]["rotation"] == {"x": 90, "y": 0, "z": 0}


def test_turns_to_a_rotation_in_the_hand(bench):
    bench.ok("RotateHeldObject", rotation={"x": 90, "y": 180, "z": 0})
    assert bench.metadata["hand"]["localRotation"] == {"x": 90, "y": 180, "z": 0}


def test_the_hand_returns_unless_the_agent_keeps_its_grip(bench):
    usual = bench.metadata["heldObjectPose"]
    bench.ok("MoveHeldObject", ahead=0.1)
    bench.ok("RotateHeldObject", pitch=40)
    moved = bench.metadata["heldObjectPose"]
    bench.ok("RotateRight", manualInteract=True)
    for pose in ("localPosition", "localRotation"):
        assert bench.metadata["heldObjectPose"][pose] == pytest.approx(moved[pose], abs=1e-4)
    bench.ok("RotateLeft")
    assert bench.metadata["heldObjectPose"]["localPosition"] != moved["localPosition"]
    assert np.allclose(change(bench, usual, "localPosition")[2], 0, atol=0.1)


@pytest.mark.parametrize(
    "action", ["DropHeldObject", "DropHandObject", "ThrowObject", "MoveHeldObject"]
)
def test_an_empty_hand(bench, action):
    bench.ok("DropHandObject")
    bench.refused(action)
    assert bench.metadata["errorCode"] == "ObjectNotInInventory"


def test_a_held_object_stands_upright_with_its_origin_at_the_hand(bench):
    # as AI2-THOR 5.0.0 reported it of 30 objects, however they had lain (horizon 0)
    bench.ok("DropHandObject")
    knife = bench.first("Knife")
    bench.ok("Teleport", horizon=0, rotation={"y": 90})
    item = bench.sim.world.objects[knife]
    item.rotation = np.array([10.0, 33.0, 90.0])
    bench.force("PickupObject", knife)
    metadata = bench.ok("Teleport", horizon=0, rotation={"y": 90})
    pose = metadata["heldObjectPose"]
    assert pose["localPosition"] == pytest.approx({"x": 0.0, "y": -0.16, "z": 0.38})
    assert pose["localRotation"] == pytest.approx({"x": 0.0, "y": 0.0, "z": 0.0})
    held = bench.object(knife)
    assert held["position"] == pytest.approx(pose["position"], abs=1e-5)
    assert held["rotation"] == pytest.approx({"x": 0.0, "y": 90.0, "z": 0.0})
