"""Picking up with the arm, carrying, and letting go."""

import numpy as np
import pytest

from infthor_sim.geometry import euler_matrix
from infthor_sim.physics.receptacles import surfaces

from ..harness import Bench
from .harness import arm_bench, hand_to, loose, wrist


def held_pose(bench: Bench, object_id: str) -> tuple[np.ndarray, np.ndarray]:
    """Pose of a thing in the wrist's frame, from the world itself."""
    world = bench.sim.world
    item, frame = world.objects[object_id], world.arm.wrist(world.agent)
    return frame.local(item.position), frame.turn.T @ euler_matrix(item.rotation)


def holding(object_type: str) -> tuple[Bench, str]:
    """An arm that has picked up a thing, and its id."""
    bench = arm_bench()
    thing = loose(bench, object_type)
    hand_to(bench, thing)
    bench.ok("PickupObject")
    return bench, thing


def test_what_is_in_the_sphere_is_picked_up_and_goes_along():
    bench = arm_bench()
    potato = loose(bench, "Potato")
    hand_to(bench, potato)
    metadata = bench.ok("PickupObject")
    assert metadata["arm"]["heldObjects"] == [potato]
    assert metadata["arm"]["pickupableObjects"] == metadata["arm"]["touchedNotHeldObjects"] == []
    assert bench.object(potato)["isPickedUp"] and bench.object(potato)["parentReceptacles"] is None
    assert metadata["inventoryObjects"] == []
    before, at = held_pose(bench, potato), bench.object(potato)["position"]
    bench.ok("MoveArmRelative", offset={"x": 0.05, "y": 0.1, "z": -0.05})
    bench.ok("RotateWristRelative", pitch=30, roll=20)
    bench.ok("MoveArmBaseUp", distance=0.1)
    bench.ok("MoveBack", moveMagnitude=0.1)
    bench.ok("RotateAgent", degrees=-20)
    after = held_pose(bench, potato)
    assert after[0] == pytest.approx(before[0], abs=1e-6)
    assert after[1] == pytest.approx(before[1], abs=1e-6)
    assert bench.object(potato)["position"] != at


def test_a_thing_let_go_falls_flat_onto_what_is_below_and_belongs_to_it():
    bench = arm_bench()
    plate = loose(bench, "Plate")
    hand_to(bench, plate)
    counter = bench.object(plate)["parentReceptacles"]
    bench.ok("PickupObject")
    bench.ok("MoveArmRelative", offset={"y": 0.15})
    bench.ok("RotateWristRelative", pitch=20, roll=15)
    bench.ok("ReleaseObject")
    fallen = bench.object(plate)
    assert fallen["parentReceptacles"] == counter
    assert plate in bench.object(counter[0])["receptacleObjectIds"]
    top = bench.sim.world.objects[counter[0]].surface_height()
    assert bench.sim.world.objects[plate].bounds()[0][1] == pytest.approx(top, abs=1e-6)
    up = euler_matrix(list(fallen["rotation"].values()))[1]
    assert np.abs(up).max() == pytest.approx(1, abs=1e-6)
    assert not fallen["isPickedUp"] and bench.metadata["arm"]["heldObjects"] == []
    bench.ok("ReleaseObject")  # with nothing to release, as in Unity


def test_candidates_narrow_what_is_picked_up():
    bench = arm_bench()
    plate = loose(bench, "Plate")
    hand_to(bench, plate)
    message = bench.refused("PickupObject", objectIdCandidates=[loose(bench, "Potato")])
    assert message == "No objects (specified by objectId) were valid to be picked up by the arm"
    bench.ok("PickupObject", objectIdCandidates=[plate, "Nothing|1"])


def put_into_hand(bench: Bench, object_id: str) -> None:
    """Bring a thing to the hand, rather than the hand to it."""
    world = bench.sim.world
    item = world.objects[object_id]
    middle = world.arm.sphere(world.agent)
    world.detach(item)
    world.shift([item], middle - item.center)
    bench.ok("PickupObject", objectIdCandidates=[object_id])


def test_contents_of_what_is_held_come_along_and_stay_in_it():
    bench = arm_bench("kitchen-2")
    bowl, egg = loose(bench, "Bowl"), loose(bench, "Egg")
    world = bench.sim.world
    world.detach(world.objects[egg])
    world.shift([world.objects[egg]], world.objects[bowl].center - world.objects[egg].center)
    world.attach(world.objects[egg], world.objects[bowl])
    bench.ok("MoveArmBase", y=0.8)
    put_into_hand(bench, bowl)
    before = held_pose(bench, egg)
    bench.ok("RotateWristRelative", pitch=25)
    bench.ok("MoveArmRelative", offset={"y": 0.1})
    after = held_pose(bench, egg)
    assert after[0] == pytest.approx(before[0], abs=1e-6) and after[1] == pytest.approx(
        before[1], abs=1e-6
    )
    assert bench.object(egg)["parentReceptacles"] == [bowl]
    bench.ok("SetHandSphereRadius", radius=0.3)
    bench.ok("PickupObject", objectIdCandidates=[egg])
    assert bench.metadata["arm"]["heldObjects"] == [bowl, egg]
    bench.ok("ReleaseObject")
    assert not bench.object(bowl)["isPickedUp"] and not bench.object(egg)["isPickedUp"]
    assert bench.sim.world.arm.held_contents == {}


def up(metres: float) -> np.ndarray:
    return np.array([0.0, metres, 0.0])


def drop_over(bench: Bench, object_id: str, point: np.ndarray) -> dict:
    """Let go of a thing with its middle above a point, wherever the agent may be."""
    world = bench.sim.world
    world.agent.position[[0, 2]] += (point - world.arm.sphere(world.agent))[[0, 2]]
    world.arm.change(world.arm.rig.with_lift(world.arm.pose, point[1] - world.agent.position[1]))
    put_into_hand(bench, object_id)
    bench.ok("ReleaseObject")
    return bench.object(object_id)


@pytest.mark.parametrize(
    ("scene", "kind"),
    [("kitchen-1", "SinkBasin"), ("bathroom-1", "SinkBasin"), ("bathroom-1", "BathtubBasin")],
)
def test_things_fall_into_basins(scene, kind):
    bench = arm_bench(scene)
    thing = loose(bench, "Potato" if scene == "kitchen-1" else "SoapBar")
    basin = bench.sim.world.objects[bench.first(kind)]
    low, high = basin.bounds()
    fallen = drop_over(bench, thing, (low + high) / 2 + up(0.5))
    assert fallen["parentReceptacles"] == [basin.object_id]
    assert low[1] - 0.1 < bench.sim.world.objects[thing].bounds()[0][1] < high[1]


def test_things_fall_into_open_drawers_and_onto_closed_ones_not():
    bench = arm_bench()
    drawer = bench.sim.world.objects[bench.first("Drawer")]
    potato = loose(bench, "Potato")
    bench.force("OpenObject", drawer.object_id)
    (tray,) = surfaces(drawer)
    ahead = (
        drawer.matrix @ euler_matrix((0, drawer.front, 0)) @ np.array([0, 0, tray.half[1] - 0.06])
    )
    fallen = drop_over(bench, potato, tray.center + ahead + up(0.4))
    assert fallen["parentReceptacles"] == [drawer.object_id]
    bench.force("CloseObject", drawer.object_id)
    assert not bench.object(potato)["visible"]


def test_things_fall_into_an_open_cupboard_below_a_sink_and_past_it_into_the_sink():
    bench = arm_bench()
    world = bench.sim.world
    basin = world.objects[bench.first("SinkBasin")]
    low, high = basin.bounds()
    middle = (low + high) / 2
    cupboard = next(
        item
        for item in world.objects.values()
        if item.object_type == "Cabinet"
        and (item.bounds()[0] < middle).all()
        and (item.bounds()[1] > middle).all()
    )
    bench.force("OpenObject", cupboard.object_id)
    for thing in list(cupboard.contents):
        bench.ok("RemoveFromScene", thing)
    potato = loose(bench, "Potato")
    within = np.array([middle[0], cupboard.center[1] - 0.1, middle[2]])
    assert drop_over(bench, potato, within)["parentReceptacles"] == [cupboard.object_id]
    assert drop_over(bench, potato, middle + up(0.5))["parentReceptacles"] == [basin.object_id]


def test_a_thing_falls_into_a_bowl_whose_floor_is_a_little_below_that_of_the_sink_it_stands_in():
    bench = arm_bench()
    world = bench.sim.world
    basin, bowl = world.objects[bench.first("SinkBasin")], world.objects[bench.first("Bowl")]
    low, high = basin.bounds()
    floor = float(surfaces(basin)[0].center[1])
    bowl.place_bottom(np.array([(low + high)[0] / 2, floor, (low + high)[2] / 2]))
    bowl.place_bottom(
        np.array(
            [bowl.center[0], 2 * floor - float(surfaces(bowl)[0].center[1]) - 0.005, bowl.center[2]]
        )
    )
    world.set_pose(bowl, bowl.position, bowl.rotation)
    world.detach(bowl)
    world.attach(bowl, basin)
    assert surfaces(bowl)[0].center[1] < floor
    fallen = drop_over(bench, bench.first("Spoon"), bowl.center + up(0.3))
    assert bowl.object_id in fallen["parentReceptacles"]


def test_a_thing_lands_on_another_and_on_the_floor():
    bench = arm_bench()
    potato, plate = loose(bench, "Potato"), loose(bench, "Plate")
    place = bench.sim.world.objects[plate].center
    assert drop_over(bench, potato, place + up(0.3))["parentReceptacles"] == [plate]
    floor = np.array([*next(iter(bench.sim.world.nav))])
    fallen = drop_over(bench, potato, np.array([floor[0], 0.6, floor[1]]))
    assert fallen["parentReceptacles"] in (None, [bench.first("Floor")])
    assert bench.sim.world.objects[potato].bounds()[0][1] == pytest.approx(0)


def test_held_things_collide():
    bench, plate = holding("Plate")
    bench.ok("MoveArmRelative", offset={"y": 0.1})
    at = wrist(bench)
    message = bench.refused("MoveArmRelative", offset={"y": -0.2}, returnToStart=False)
    assert "CounterTop" in message
    # It stops with the plate on the counter, so the wrist is where it was before lifting, give or
    # take a step.
    assert at[1] - wrist(bench)[1] == pytest.approx(0.1, abs=0.021)
    low = bench.sim.world.objects[plate].bounds()[0][1]
    assert low > bench.sim.world.objects[bench.first("CounterTop")].surface_height() - 0.01


def test_restoring_a_scene_empties_the_arm():
    bench, potato = holding("Potato")
    item = bench.object(potato)
    pose = {"objectName": item["name"], "position": item["position"], "rotation": item["rotation"]}
    bench.ok("SetObjectPoses", objectPoses=[pose])
    assert bench.metadata["arm"]["heldObjects"] == []
    assert not any(o["isPickedUp"] for o in bench.metadata["objects"])


def test_teleporting_takes_along_what_is_held():
    bench, potato = holding("Potato")
    before = held_pose(bench, potato)
    x, z = next(iter(bench.sim.world.nav))
    bench.teleport(x, z, 30)
    assert held_pose(bench, potato)[0] == pytest.approx(before[0], abs=1e-6)


@pytest.mark.parametrize(("threshold", "passes"), [(None, True), (0.001, False)])
def test_a_heavy_thing_stops_the_arm_where_a_threshold_says_so(threshold, passes):
    bench = arm_bench(massThreshold=threshold)
    hand_to(bench, loose(bench, "Plate"))
    bench.ok("MoveArmRelative", offset={"y": 0.1})
    assert bench.step("MoveArmRelative", offset={"y": -0.125})["lastActionSuccess"] == passes


@pytest.mark.parametrize(("spared", "again"), [(False, False), (True, False), (True, True)])
def test_a_far_fall_breaks_objects_unless_their_type_is_unbreakable(spared, again):
    bench = arm_bench()
    plate = loose(bench, "Plate")
    bench.ok("PausePhysicsAutoSim")
    if spared:
        bench.ok("MakeObjectsOfTypeUnbreakable", objectType="Plate")
    if again:
        bench.ok("MakeObjectBreakable", plate)
    x, z = max(bench.sim.world.nav, key=lambda c: bench.sim.world.nav.count_free_ahead(*c, 0.0))
    drop_over(bench, plate, np.array([x, 1.4, z]))
    assert bench.object(plate)["isBroken"] == (again or not spared)
    bench.ok("AdvancePhysicsStep", simSeconds=1.0)
    assert "timeStep between" in bench.refused("AdvancePhysicsStep", timeStep=0.1)


def test_a_new_start_of_the_agent_lets_go_of_what_an_arm_holds_and_of_nothing_in_a_hand():
    bench = arm_bench()
    plate = loose(bench, "Plate")
    hand_to(bench, plate)
    on = bench.object(plate)["parentReceptacles"]
    bench.ok("PickupObject")
    bench.ok("MoveArmRelative", offset={"y": 0.1})
    bench.ok("Initialize", agentMode="default", visibilityDistance=1.5)
    assert bench.object(plate)["parentReceptacles"] == on and not bench.object(plate)["isPickedUp"]
    bench.force("PickupObject", plate)
    held = bench.ok("Initialize", agentMode="default", visibilityDistance=1.5)["inventoryObjects"]
    assert [o["objectId"] for o in held] == [plate]
    bench.ok("Initialize", agentMode="arm")
    assert bench.metadata["inventoryObjects"] == [] and not bench.object(plate)["isPickedUp"]
