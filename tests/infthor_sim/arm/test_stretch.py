"""The stretch robot: its own arm, the actions that it shares."""

import numpy as np
import pytest

from ..harness import Bench
from .harness import arm_bench, xyz


@pytest.fixture
def bench() -> Bench:
    new = arm_bench(agentMode="stretch")
    world = new.sim.world
    x, z = max(world.nav, key=lambda c: world.nav.count_free_ahead(*c, 90.0))
    new.teleport(x, z, horizon=30)
    return new


def sphere(bench: Bench) -> np.ndarray:
    return np.array(list(bench.metadata["arm"]["handSphereCenter"].values()))


def test_joints_are_where_a_recorded_build_has_them():
    """A pose that somebody published: agent at (4.2, 0.901, 5.0) looking along x."""
    bench = arm_bench(agentMode="stretch")
    bench.sim.world.agent.position = np.array([4.2, 0.9009922, 5.0])
    bench.sim.world.agent.yaw = 90.0
    joints = {j["name"]: j for j in bench.ok("Pass")["arm"]["joints"]}
    assert len(joints) == 8
    recorded = {
        "stretch_robot_lift_jnt": (4.13, 0.4153, 5.135),
        "stretch_robot_arm_1_jnt": (4.0931, 0.4153, 4.8803),
        "stretch_robot_arm_5_jnt": (4.0931, 0.4153, 4.8295),
        "stretch_robot_wrist_1_jnt": (4.1761, 0.4018, 4.8563),
        "stretch_robot_wrist_2_jnt": (4.1761, 0.3510, 4.8563),
    }
    for name, place in recorded.items():
        assert list(joints[name]["position"].values()) == pytest.approx(place, abs=2e-3)
    assert sphere(bench) == pytest.approx([4.1761, 0.2524, 5.0610], abs=2e-3)
    wrist = joints["stretch_robot_wrist_2_jnt"]
    assert wrist["rotation"] == {"x": 1, "y": 0, "z": 0, "w": 0}
    assert wrist["rootRelativeRotation"] == {"x": 0, "y": 1, "z": 0, "w": 180}


def test_the_lift_rises_and_the_telescope_comes_out_to_the_right(bench):
    before = sphere(bench)
    bench.ok("MoveArm", position={"x": 0, "y": 0.6, "z": 0})
    bench.ok("MoveArm", position={"x": 0.3, "y": 0.6, "z": 0.3})
    assert sphere(bench) - before == pytest.approx([0.3, 0.6 - 0.1645, 0], abs=1e-4)
    bench.ok("MoveArm", position={"x": 0, "y": 5, "z": 0.3})
    assert sphere(bench)[1] - before[1] == pytest.approx(1.045 - 0.1645, abs=1e-4)
    bench.ok("MoveArmRelative", offset={"z": -0.1})
    bench.ok("MoveArmBase", y=0.5)
    bench.ok("MoveArmBaseDown", distance=0.1)


def test_the_wrist_turns_about_the_vertical_alone(bench):
    bench.ok("RotateWristRelative", yaw=30)
    assert (
        bench.refused("RotateWristRelative", pitch=10)
        == "Pitch and roll are not supported for the stretch agent."
    )
    bench.step("RotateElbowRelative", degrees=10)
    assert bench.metadata["errorCode"] == "InvalidAction"


def test_things_are_picked_up_and_let_go(bench):
    world = bench.sim.world
    bench.ok("MoveArm", position={"x": 0, "y": 0.9, "z": 0})
    plate = next(o for o in world.objects.values() if o.type.pickupable and not world.is_hidden(o))
    world.detach(plate)
    world.shift([plate], sphere(bench) - plate.center)
    bench.ok("PickupObject", objectIdCandidates=[plate.object_id])
    at = bench.object(plate.object_id)["position"]
    bench.ok("MoveAgent", ahead=0.1)
    bench.ok("RotateAgent", degrees=-10)
    assert bench.object(plate.object_id)["position"] != at
    assert bench.metadata["arm"]["heldObjects"] == [plate.object_id]
    bench.ok("ReleaseObject")
    assert bench.sim.world.objects[plate.object_id].bounds()[0][1] < 0.9
    assert xyz(sphere(bench)) == bench.metadata["arm"]["handSphereCenter"]


def test_the_camera_is_the_robot_s_own(bench):
    agent = bench.metadata["agent"]["position"]
    assert bench.metadata["cameraPosition"]["y"] - agent["y"] == pytest.approx(0.5447, abs=1e-4)
    assert bench.metadata["cameraPosition"]["z"] - agent["z"] == pytest.approx(0.0679, abs=1e-4)
