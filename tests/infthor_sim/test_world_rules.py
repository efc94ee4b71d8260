"""What actions do to the world, and what the world refuses."""

import pytest

from infthor_sim.arm.holding import pick_up
from infthor_sim.geometry import object_id

from .harness import Bench
from .test_invariants import consistent


def take(bench: Bench, object_type: str) -> str:
    found = bench.first(object_type)
    bench.force("PickupObject", found)
    return found


def test_pick_up_carry_and_put(bench):
    mug = take(bench, "Mug")
    assert bench.metadata["inventoryObjects"] == [{"objectId": mug, "objectType": "Mug"}]
    held = bench.object(mug)
    assert held["isPickedUp"]
    assert held["parentReceptacles"] is None
    where = held["position"]
    bench.ok("RotateRight")
    assert bench.object(mug)["position"] != where
    assert "already" in bench.refused("PickupObject", bench.first("Apple"), forceAction=True)
    counter = bench.first("CounterTop")
    bench.force("PutObject", counter)
    assert bench.metadata["inventoryObjects"] == []
    assert bench.object(mug)["parentReceptacles"] == [counter]
    assert mug in bench.object(counter)["receptacleObjectIds"]
    assert mug == bench.object(mug)["objectId"], "an id stays when the object moves"


def test_a_put_needs_a_fitting_open_receptacle(bench):
    fridge = bench.first("Fridge")
    take(bench, "Apple")
    assert "CLOSED" in bench.refused("PutObject", fridge, forceAction=True)
    assert bench.metadata["errorCode"] == "ReceptacleNotOpen"
    bench.force("OpenObject", fridge)
    assert "cannot be placed" in bench.refused(
        "PutObject", bench.first("Toaster"), forceAction=True
    )
    bench.force("PutObject", fridge)
    assert "isn't holding" in bench.refused("PutObject", fridge, forceAction=True)


def test_a_receptacle_fills_up(bench):
    world = bench.sim.world
    burner = bench.first("StoveBurner")
    for _ in range(3):
        for object_type in ("Pan", "Pot"):
            pans = [
                o.object_id
                for o in world.objects.values()
                if o.object_type == object_type and o.parent != burner
            ]
            if not pans:
                continue
            bench.force("PickupObject", pans[0])
            if not bench.step("PutObject", burner, forceAction=True)["lastActionSuccess"]:
                assert bench.metadata["errorMessage"] == "No valid positions to place object found"
                return
    pytest.fail("a burner took several pans")


def test_far_and_hidden_things_are_out_of_reach(bench):
    inside = next(o for o in bench.sim.world.objects.values() if bench.sim.world.is_hidden(o))
    bench.stand_before(inside.parent)
    message = "Target object not found within the specified visibility."
    assert bench.refused("PickupObject", inside.object_id) == message
    bench.ok("OpenObject", inside.parent)
    bench.ok("CloseObject", inside.parent)
    assert not bench.object(inside.object_id)["visible"]
    assert "is not the objectId" in bench.refused("PickupObject", "Mug|+09.00|+09.00|+09.00")
    assert "CanPickup" in bench.refused("PickupObject", inside.parent)


def test_contents_come_along_with_a_drawer_and_a_plate(bench):
    world = bench.sim.world
    drawer = next(o for o in world.objects.values() if o.object_type == "Drawer" and o.contents)
    inside = world.objects[drawer.contents[0]]
    before = inside.position.copy()
    bench.force("OpenObject", drawer.object_id, openness=0.5)
    halfway = inside.position.copy()
    bench.force("OpenObject", drawer.object_id)
    assert (inside.position - before) == pytest.approx((halfway - before) * 2)
    assert abs(halfway - before).sum() > 0.1
    bench.force("CloseObject", drawer.object_id)
    assert inside.position == pytest.approx(before)
    plate, apple = bench.first("Plate"), bench.first("Apple")
    bench.force("PickupObject", apple)
    bench.force("PutObject", plate)
    offset = world.objects[apple].center - world.objects[plate].center
    bench.force("PickupObject", plate)
    assert (world.objects[apple].center - world.objects[plate].center)[1] == pytest.approx(
        offset[1]
    )
    bench.force("PutObject", bench.first("DiningTable"))
    assert bench.object(apple)["parentReceptacles"] == [plate]


def test_slices_are_new_objects(bench):
    apple = bench.first("Apple")
    home = bench.object(apple)["parentReceptacles"]
    bench.force("SliceObject", apple)
    slices = [o for o in bench.metadata["objects"] if o["objectType"] == "AppleSliced"]
    assert len(slices) >= 2
    assert all(s["objectId"].startswith(f"{apple}|AppleSliced_") and s["isSliced"] for s in slices)
    assert all(s["parentReceptacles"] == home for s in slices)
    assert apple not in {o["objectId"] for o in bench.metadata["objects"]}
    assert "CanBeSliced" in bench.refused("SliceObject", bench.first("Mug"), forceAction=True)


def test_microwave_heats_and_fridge_cools(bench):
    microwave, fridge = bench.first("Microwave"), bench.first("Fridge")
    potato = take(bench, "Potato")
    bench.force("OpenObject", microwave)
    bench.force("PutObject", microwave)
    assert "closed" in bench.refused("ToggleObjectOn", microwave, forceAction=True)
    bench.force("CloseObject", microwave)
    bench.force("ToggleObjectOn", microwave)
    assert bench.object(potato)["temperature"] == "Hot"
    assert bench.object(potato)["isCooked"]
    bench.refused("OpenObject", microwave, forceAction=True)
    bench.force("ToggleObjectOff", microwave)
    bench.force("OpenObject", microwave)
    bench.force("PickupObject", potato)
    bench.force("OpenObject", fridge)
    bench.force("PutObject", fridge)
    bench.force("CloseObject", fridge)
    assert bench.object(potato)["temperature"] == "Cold"


def test_tap_cleans_and_fills_and_coffee_machine_fills(bench):
    faucet, basin, machine = map(bench.first, ("Faucet", "SinkBasin", "CoffeeMachine"))
    mug = bench.first("Mug")
    bench.force("DirtyObject", mug)
    bench.force("PickupObject", mug)
    bench.force("PutObject", basin)
    assert bench.object(mug)["isDirty"]
    bench.force("ToggleObjectOn", faucet)
    assert not bench.object(mug)["isDirty"]
    assert bench.object(mug)["fillLiquid"] == "water"
    bench.force("ToggleObjectOff", faucet)
    bench.force("EmptyLiquidFromObject", mug)
    bench.force("PickupObject", mug)
    bench.force("PutObject", machine)
    bench.force("ToggleObjectOn", machine)
    assert bench.object(mug)["fillLiquid"] == "coffee"


def test_knobs_light_burners_that_cook(bench):
    knob = bench.first("StoveKnob")
    burner = bench.object(knob)["controlledObjects"][0]
    pan, potato = bench.first("Pan"), bench.first("Potato")
    bench.force("PickupObject", potato)
    bench.force("PutObject", pan)
    if bench.object(pan)["parentReceptacles"] != [burner]:
        bench.force("PickupObject", pan)
        bench.force("PutObject", burner)
    assert "StoveKnob" in bench.refused("ToggleObjectOn", burner, forceAction=True)
    bench.force("ToggleObjectOn", knob)
    assert bench.object(burner)["isToggled"]
    assert bench.object(potato)["isCooked"]
    assert "already" in bench.refused("ToggleObjectOn", knob, forceAction=True)


@pytest.mark.parametrize(
    ("action", "object_type", "flag"),
    [("DirtyObject", "Plate", "isDirty"), ("BreakObject", "Cup", "isBroken"),
     ("UseUpObject", "SoapBottle", "isUsedUp"),
     ("CookObject", "Potato", "isCooked")],
)  # fmt: skip
def test_direct_changes_of_state(bench, action, object_type, flag):
    target = bench.first(object_type)
    bench.force(action, target)
    assert bench.object(target)[flag]
    bench.refused(action, target, forceAction=True)
    bench.refused(action, bench.first("Fridge"), forceAction=True)


def test_a_dropped_cup_breaks_and_lies_on_something(bench):
    cup = take(bench, "Cup")
    bench.ok("DropHandObject")
    item = bench.object(cup)
    assert not item["isPickedUp"]
    low = min(c[1] for c in item["axisAlignedBoundingBox"]["cornerPoints"])
    assert low == pytest.approx(0.0, abs=0.01) or item["parentReceptacles"]
    assert item["isBroken"] == (low < 0.3)


def test_an_open_fridge_stands_in_the_way():
    bench = Bench.at("kitchen-1")
    fridge = bench.first("Fridge")
    bench.force("OpenObject", fridge)
    world = bench.sim.world
    from infthor_sim.physics.obstacles import blocking_object, door_leaf

    low, high = door_leaf(world.objects[fridge])
    middle = (low + high) / 2
    middle[1] = world.agent.position[1]
    assert blocking_object(world, middle) == world.objects[fridge].name
    bench.force("CloseObject", fridge)
    assert blocking_object(world, middle) is None


def test_agent_modes_and_bad_settings_are_refused(bench):
    assert "agentMode" in bench.refused("Initialize", agentMode="drone")
    assert "gridSize" in bench.refused("Initialize", gridSize=0)
    assert bench.metadata["errorCode"] == "InvalidArgument"


@pytest.mark.parametrize("position", [{"x": 50, "y": 0.9, "z": 0}, {"x": -1.5, "y": 0.9, "z": 2.0}])
def test_teleport_refuses_what_collides(bench, position):
    before = bench.metadata["agent"]["position"]
    bench.refused("Teleport", position=position)
    assert bench.metadata["agent"]["position"] == before


def test_random_placement_follows_its_seed(bench):
    def places() -> list[tuple[str, object]]:
        loose = [o for o in bench.metadata["objects"] if o["pickupable"]]
        return [(o["objectId"], o["parentReceptacles"]) for o in loose]

    start = places()
    bench.ok("InitialRandomSpawn", randomSeed=3)
    third = places()
    bench.ok("InitialRandomSpawn", randomSeed=4)
    assert len({repr(p) for p in (start, third, places())}) == 3
    bench.reset("kitchen-1")
    bench.ok("InitialRandomSpawn", randomSeed=3)
    assert places() == third
    drawn = []
    for seed in ({}, {"randomSeed": 0}):
        bench.reset("kitchen-1")
        bench.ok("SetRandomSeed", seed=9)
        bench.ok("InitialRandomSpawn", **seed)
        drawn.append(places())
    assert drawn[0] == drawn[1], "without a seed it is seed 0"
    assert drawn[0] != third


@pytest.mark.parametrize(
    ("action", "arguments", "message"),
    [
        ("InitialRandomSpawn", {"numPlacementAttempts": 0}, "must be a positive integer"),
        ("InitialRandomSpawn", {"excludedReceptacles": ["Fridg"]}, "'Fridg' is not an object type"),
        ("InitialRandomSpawn", {"excludedObjectIds": ["Mug|1"]}, "Mug|1"),
        ("SetObjectToggles", {"objectToggles": [{"objectType": "Lamp"}]}, "'Lamp' is not an"),
        ("SetObjectStates", {"SetObjectStates": {"stateChange": "openable", "objectType": "Door2"}},
         "'Door2' is not an object type"),
        ("SetObjectStates", {"SetObjectStates": {"stateChange": "openable", "objectType": ["Mug"]}},
         "['Mug'] is not an object type"),
    ],
)  # fmt: skip
def test_what_names_nothing_changes_nothing(bench, action, arguments, message):
    before = bench.metadata["objects"]
    assert message in bench.refused(action, **arguments)
    assert bench.ok("Pass")["objects"] == before


def test_random_placement_gives_ids_by_the_new_positions(bench):
    bench.force("PickupObject", bench.first("Egg"))
    bench.ok("RandomizeColors")
    looks = bench.sim.world.appearance
    before = [(o["name"], o["objectId"]) for o in bench.metadata["objects"]]
    finishes = {name: looks.finishes[old] for name, old in before}
    bench.ok("SetObjectFilter", objectIds=[bench.first("SoapBottle")])

    only = bench.ok("InitialRandomSpawn", randomSeed=3)["objects"]
    assert [o["objectType"] for o in only] == ["SoapBottle"]
    metadata = bench.ok("ResetObjectFilter")
    consistent(metadata)
    assert [o["name"] for o in metadata["objects"]] == [name for name, _ in before]
    old = dict(before)
    for item in metadata["objects"]:
        at = bench.sim.world.objects[item["objectId"]].position
        if item["pickupable"]:
            assert item["objectId"].startswith(object_id(item["objectType"], at))
        else:
            assert item["objectId"] == old[item["name"]]
        assert looks.finishes[item["objectId"]] is finishes[item["name"]]
    assert sum(o["objectId"] != old[o["name"]] for o in metadata["objects"]) > 10
    assert metadata["inventoryObjects"][0]["objectId"] == bench.sim.world.agent.held
    bench.ok("DropHeldObject")


def test_random_placement_keeps_what_an_arm_holds():
    bench = Bench.at("kitchen-9", agentMode="arm", size=20)
    world = bench.sim.world
    bowl = next(o for o in world.objects.values() if o.object_type == "Bowl")
    pick_up(world, world.arm, [bowl])
    bench.ok("InitialRandomSpawn", randomSeed=1)
    assert bench.metadata["arm"]["heldObjects"] == [bowl.object_id]
    assert world.objects[bowl.object_id] is bowl
    bench.ok("ReleaseObject")


@pytest.mark.parametrize("mode", ["default", "arm", "stretch"])
def test_physics_actions_move_nothing(mode):
    bench = Bench(size=20)
    before = bench.reset("kitchen-1", agentMode=mode)["objects"]
    for action, arguments in (
        ("MakeObjectsStaticKinematicMassThreshold", {}),
        ("PausePhysicsAutoSim", {}),
        ("AdvancePhysicsStep", {"timeStep": 0.01, "simSeconds": 0.5, "allowAutoSimulation": True}),
        ("UnpausePhysicsAutoSim", {}),
        ("ChangeOpenSpeed", {"x": 10000.0}),
        ("MakeObjectBreakable", {"objectId": bench.first("Mug")}),
    ):
        assert bench.ok(action, **arguments)["objects"] == before
    assert "timeStep between" in bench.refused("AdvancePhysicsStep", timeStep=0.1)
    bench.refused("MakeObjectBreakable", "Mug|none")


def test_a_pile_of_plates_is_carried_however_high_it_is(bench):
    world = bench.sim.world
    pile = [world.objects[bench.first("Plate")]]
    for number in range(2000):
        plate = pile[-1].duplicate(f"Plate|{number}")
        world.add(plate)
        world.attach(plate, pile[-1])
        pile.append(plate)
    assert list(world.descendants(pile[0])) == pile[1:]


def pose_of(bench: Bench, object_type: str) -> dict[str, object]:
    item = bench.object(bench.first(object_type))
    return {"objectName": item["name"], "position": item["position"], "rotation": item["rotation"]}


def names(bench: Bench) -> list[str]:
    return [o["name"] for o in bench.metadata["objects"] if o["pickupable"] or o["moveable"]]


@pytest.mark.parametrize("name", ["Ghost_1", "Mugg_1", "", "Fridge_1", "CounterTop"])
def test_a_pose_for_nothing_that_can_be_moved_fails_and_the_others_are_set(bench, name):
    fridge = pose_of(bench, "Fridge")
    wrong = {**fridge, "objectName": fridge["objectName"] if name == "Fridge_1" else name}
    message = bench.refused("SetObjectPoses", objectPoses=[pose_of(bench, "Mug"), wrong])
    assert message.startswith(f"No Pickupable or Moveable object of name {wrong['objectName']} ")
    bench.ok("Pass")
    assert [o["objectType"] for o in bench.metadata["objects"] if o["pickupable"]] == ["Mug"]
    assert pose_of(bench, "Fridge") == fridge


def test_no_poses_change_nothing(bench):
    before = bench.metadata["objects"]
    assert bench.ok("SetObjectPoses", objectPoses=[])["objects"] == before


def test_furniture_vanishes_where_other_furniture_is_listed(bench):
    mug, chair = pose_of(bench, "Mug"), pose_of(bench, "Chair")
    moved = {**chair, "position": {**chair["position"], "y": 3.0}}
    furniture = [o["name"] for o in bench.metadata["objects"] if o["moveable"]]
    bench.ok("SetObjectPoses", objectPoses=[mug, moved], skipMoveable=True)
    assert names(bench) == [*furniture, mug["objectName"]]
    assert pose_of(bench, "Chair") == chair
    bench.ok("SetObjectPoses", objectPoses=[mug])
    assert names(bench) == [*furniture, mug["objectName"]]
    bench.ok("SetObjectPoses", objectPoses=[mug, moved])
    assert names(bench) == [chair["objectName"], mug["objectName"]]
    assert pose_of(bench, "Chair") == moved


def test_copies_have_names_of_their_own(bench):
    mug = pose_of(bench, "Mug")
    above = [{**mug, "position": {**mug["position"], "y": y}} for y in (1.5, 2.0, 2.5)]
    bench.ok("SetObjectPoses", objectPoses=above)
    first = mug["objectName"]
    assert names(bench)[-3:] == [first, f"{first}(Clone)_copy_1", f"{first}(Clone)_copy_2"]
    second = {**above[0], "objectName": f"{first}(Clone)_copy_2"}
    bench.ok("SetObjectPoses", objectPoses=[second])
    assert [o["name"] for o in bench.metadata["objects"] if o["pickupable"]] == [
        second["objectName"]
    ]


def test_more_poses_than_a_scene_has_are_refused(bench, monkeypatch):
    monkeypatch.setenv("INFTHOR_EVAL_MAX_OBJECT_POSES", "1")
    pose = {"objectName": "Mug_1", "position": {"x": 0, "y": 1, "z": 0}}
    bench.ok("SetObjectPoses", objectPoses=[pose])
    assert "2 entries, too many for a scene" in bench.refused(
        "SetObjectPoses", objectPoses=[pose, pose]
    )
