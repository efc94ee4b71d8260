"""The arm agent as the other rooms use it: through ai2thor's own Controller and typed views."""

import math

import pytest

from infthor_eval.formats.trajectory import InitAction, ObjectPose, Scene, Toggle
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import ThorObject, Vector


@pytest.fixture(scope="module")
def simulator():
    with Simulator(embedded_launch(), width=100, height=100, agentMode="arm") as simulator:
        yield simulator


def as_arguments(vector: Vector) -> dict[str, float]:
    return {"x": vector.x, "y": vector.y, "z": vector.z}


def grasp(simulator: Simulator, thing: ThorObject) -> bool:
    """Walk up to a thing and pick it up from above; False where the hand does not come to it."""
    places = simulator.query("GetReachablePositions").result
    box = thing.axis_aligned_bounding_box
    top = box.center.y + box.size.y / 2 + 0.045

    def way_to(place: dict[str, float]) -> tuple[float, float]:
        return box.center.x - place["x"], box.center.z - place["z"]

    for place in sorted(places, key=lambda p: abs(math.hypot(*way_to(p)) - 0.6))[:8]:
        aside, ahead = way_to(place)
        away = math.hypot(aside, ahead)
        turn = {"y": math.degrees(math.atan2(aside, ahead))}
        simulator.step("TeleportFull", position=place, rotation=turn, horizon=20, standing=True)
        simulator.step("MoveArm", position={"x": 0, "y": 0, "z": 0.4})
        simulator.step("MoveArmBase", y=min(top + 0.25, 1.8), normalizedY=False)
        x, z = box.center.x - 0.07 * aside / away, box.center.z - 0.07 * ahead / away
        for lift in (0.15, 0.0):
            wrist = {"x": x, "y": top + lift, "z": z}
            moved = simulator.step("MoveArm", position=wrist, coordinateSpace="world")
        if moved.success and thing.object_id in moved.arm.pickupable:
            return simulator.step("PickupObject", objectIdCandidates=[thing.object_id]).success
    return False


def test_a_thing_is_picked_up_carried_and_put_down(simulator):
    view = simulator.reset("kitchen-1")
    assert view.arm.joints[-1].name == "robot_arm_4_jnt" and view.arm.held == []
    assert view.arm.joints[0].position.y == pytest.approx(0.898, abs=1e-3)
    plates = (o for o in view.objects.values() if o.object_type == "Plate")
    plate = next(o for o in plates if o.position.y > 0.9)
    assert grasp(simulator, plate)
    view = simulator.step("MoveArmRelative", offset={"y": 0.1})
    assert view.inventory == (plate.object_id,) == tuple(view.arm.held)
    assert view.objects[plate.object_id].is_picked_up
    assert view.objects[plate.object_id].position.y > plate.position.y + 0.09
    mark = simulator.mark()
    down = simulator.step("ReleaseObject")
    assert down.inventory == ()
    assert down.objects[plate.object_id].parent_receptacles == plate.parent_receptacles
    assert simulator.rewind(mark, exactly=True).arm == view.arm
    again = simulator.step("Pass")
    assert again.arm == view.arm and again.objects[plate.object_id] == view.objects[plate.object_id]


def test_a_refused_movement_says_why(simulator):
    simulator.reset("kitchen-1")
    simulator.step("MoveArmBase", y=0)
    low = simulator.step("MoveArm", position={"x": 0, "y": -2, "z": 0.5})
    assert not low.success and low.error.startswith("Collided with static ")
    unknown = simulator.step("MoveArm", position={"x": 0, "y": 0, "z": 0.5}, pace=3)
    assert unknown.error_code == "InvalidArgument"


def test_a_recorded_scene_is_restored_for_the_arm_as_for_the_default_agent(simulator):
    view = simulator.reset("kitchen-1")
    poses = [
        ObjectPose(o.name, as_arguments(o.position), as_arguments(o.rotation))
        for o in view.objects.values()
        if o.pickupable
    ]
    at = view.agent.position
    start = InitAction(at.x, at.y, at.z, rotation=90.0, horizon=30.0)
    states = {"object_toggles": [Toggle("Faucet", True)], "dirty_and_empty": True}
    scene = Scene("kitchen-1", start, object_poses=poses, **states)
    restored = restore(simulator, scene)
    assert restored.refused == restored.dropped == []
    by_arm = simulator.view
    assert (by_arm.agent.rotation, by_arm.agent.horizon, by_arm.arm.held) == (90, 30, [])
    with Simulator(embedded_launch(), width=100, height=100) as default:
        restore(default, scene)
        assert default.view.arm is None
        assert default.view.agent == by_arm.agent
        assert default.view.objects == by_arm.objects


def test_a_house_built_from_its_description_has_the_arm_too(simulator):
    floor = [{"x": x, "y": 0, "z": z} for x, z in ((0, 0), (0, 4), (4, 4), (4, 0))]
    room = {"id": "room|1", "roomType": "Kitchen", "floorPolygon": floor}
    nothing = {"walls": [], "objects": [], "doors": [], "windows": []}
    house = {"rooms": [room | {"ceilings": [], "children": []}], **nothing}
    assert simulator.reset(house | {"proceduralParameters": {}}).arm is not None
    assert simulator.step("MoveArm", position={"x": 0, "y": 0.1, "z": 0.5}).success
