"""RoboTHOR's locobot, and the expert that leads agents to an object or a point."""

import numpy as np
import pytest

from .harness import Bench

SIGHT = {"RotateRight", "RotateLeft", "LookUp", "LookDown"}


def bench_of(scene: str, **init: object) -> Bench:
    bench = Bench(size=40)
    assert bench.reset(scene, **{"fieldOfView": None, **init})["lastActionSuccess"]
    return bench


@pytest.fixture
def robot() -> Bench:
    return bench_of("living-room-1", agentMode="locobot", applyActionNoise=False)


def test_its_camera_is_low_narrow_and_tilts_little(robot):
    metadata = robot.metadata
    assert metadata["fov"] == 60.0
    assert metadata["agent"]["position"]["y"] == pytest.approx(0.901, abs=1e-3)
    assert metadata["cameraPosition"]["y"] == pytest.approx(0.87, abs=1e-3)
    robot.ok("LookDown")
    assert "beyond 30 degrees" in robot.refused("LookDown")
    assert "must be in [-30:30]" in robot.refused("Teleport", horizon=45)
    found = robot.ok("GetInteractablePoses", robot.first("Sofa"), standings=[True])
    assert {pose["horizon"] for pose in found["actionReturn"]} <= {-30.0, 0.0, 30.0}


@pytest.mark.parametrize("action", ["PickupObject", "OpenObject", "PushObject", "Crouch"])
def test_it_can_do_nothing_to_objects(robot, action):
    assert robot.refused(action, robot.first("Sofa")) == f"Invalid action: {action}"


def test_it_moves_sideways_only_if_allowed(robot):
    assert "does not support horizontal movement" in robot.refused("MoveLeft")
    robot.ok(
        "Initialize", agentMode="locobot", allowHorizontalMovement=True, applyActionNoise=False,
        fastActionEmit=False,
    )  # fmt: skip
    robot.ok("RotateRight")
    robot.ok("MoveLeft")


def test_its_steps_and_turns_are_noisy_and_the_same_in_every_run():
    ends = []
    for _ in range(2):
        bench = bench_of("living-room-1", agentMode="locobot")
        start = bench.metadata["agent"]
        for action in ("RotateRight", "MoveAhead", "MoveAhead", "RotateLeft"):
            bench.ok(action)
        ends.append(bench.metadata["agent"])
    assert ends[0] == ends[1]
    turned = (ends[0]["rotation"]["y"] - start["rotation"]["y"] + 180) % 360 - 180
    assert 0 < abs(turned) < 3
    way = np.array([ends[0]["position"][axis] - start["position"][axis] for axis in "xz"])
    assert float(np.hypot(*way)) == pytest.approx(0.5, abs=0.05)
    assert float(np.hypot(*way)) != 0.5


def test_a_full_teleport_needs_no_standing(robot):
    here = robot.metadata["agent"]["position"]
    assert "horizon" in robot.refused("TeleportFull", position=here, rotation={"y": 90})
    robot.ok("TeleportFull", **here, rotation={"y": 90}, horizon=0)


def test_noise_of_an_action_is_added(robot):
    robot.ok("RotateRight", noise=5.0)
    assert robot.metadata["agent"]["rotation"]["y"] % 90 == 5.0


def test_a_negative_spread_is_refused(robot):
    message = robot.refused("Initialize", agentMode="locobot", rotateGaussianSigma=-1.0)
    assert message == "rotateGaussianSigma must be at least 0, not -1.0"


def follow(bench: Bench, **goal: object) -> list[str]:
    done = []
    while (name := bench.ok("ObjectNavExpertAction", **goal)["actionReturn"]) is not None:
        bench.ok(name)
        done.append(name)
        assert len(done) < 80
    return done


@pytest.mark.parametrize(("step", "mode"), [(30, "locobot"), (20, "default"), (90, "default")])
def test_the_expert_leads_to_where_an_object_is_seen(step, mode):
    bench = bench_of("house-2", rotateStepDegrees=step, agentMode=mode)
    television = bench.first("Television")
    assert not bench.object(television)["visible"]
    assert "MoveAhead" in follow(bench, objectType="Television")
    assert any(o["objectType"] == "Television" and o["visible"] for o in bench.metadata["objects"])
    assert follow(bench, objectType="Television") == []


def test_the_expert_turns_to_what_is_behind_the_agent():
    bench = bench_of("kitchen-1", rotateStepDegrees=45)
    fridge = bench.first("Fridge")
    bench.stand_before(fridge)
    bench.ok("RotateRight", degrees=180)
    actions = follow(bench, objectId=fridge)
    assert set(actions) <= SIGHT
    assert bench.object(fridge)["visible"]


def test_robothors_apartments_are_refused_by_name():
    message = Bench().refused("Reset", sceneName="FloorPlan_Train1_1")
    assert message.startswith("FloorPlan_Train1_1 is an apartment of RoboTHOR, of which there is")
    assert "house-<seed>" in message


def test_the_expert_leads_to_a_point():
    bench = bench_of("house-2", rotateStepDegrees=20)
    x, z = max(bench.sim.world.nav)
    follow(bench, position={"x": x, "y": 0.9, "z": z})
    here = bench.metadata["agent"]["position"]
    assert np.hypot(here["x"] - x, here["z"] - z) < 0.25


def test_what_the_expert_cannot_do():
    bench = bench_of("kitchen-1", rotateStepDegrees=70)
    assert "must be a divisor of 360" in bench.refused("ObjectNavExpertAction", objectType="Egg")
    bench.ok("Initialize", rotateStepDegrees=90, fastActionEmit=False)
    fridge = bench.first("Fridge")
    inside = bench.object(fridge)["axisAlignedBoundingBox"]["center"]
    egg = {"objectId": bench.first("Egg")}
    bench.force("TeleportObject", **egg, position=inside, rotation={})
    with pytest.raises(AssertionError, match="is not visible on navigation path"):
        follow(bench, **egg)
