"""Putting objects anywhere, pushing them, and taking them out of the scene for a time."""

import numpy as np
import pytest

from infthor_sim.geometry import to_xyz
from infthor_sim.objects import default_object
from infthor_sim.physics.receptacles import surfaces

from .harness import Bench


def bottom(bench: Bench, object_id: str) -> float:
    return min(
        corner[1] for corner in bench.object(object_id)["axisAlignedBoundingBox"]["cornerPoints"]
    )


def free_point(bench: Bench, receptacle: str, object_id: str) -> dict[str, float]:
    for point in bench.ok("GetSpawnCoordinatesAboveReceptacle", receptacle)["actionReturn"]:
        if bench.step("PlaceObjectAtPoint", object_id, position=point)["lastActionSuccess"]:
            return point
    raise AssertionError(f"no room on {receptacle}")


def test_an_object_stands_on_a_point_of_a_receptacle(bench):
    table, mug = bench.first("DiningTable"), bench.first("Mug")
    point = free_point(bench, table, mug)
    assert bottom(bench, mug) == pytest.approx(point["y"], abs=1e-3)
    assert bench.object(mug)["parentReceptacles"] == [table]
    apple = bench.first("Apple")
    assert "not clear" in bench.refused("PlaceObjectAtPoint", apple, position=point)
    outside = {"x": 40, "y": 0, "z": 0}
    assert "not clear" in bench.refused("PlaceObjectAtPoint", apple, position=outside)


@pytest.mark.parametrize(
    ("vessel", "kind"), [("Bowl", "Apple"), ("Pot", "Egg"), ("Cup", "Pencil"), ("Box", "Bowl")]
)
def test_vessels_are_hollow(bench, vessel, kind):
    around, item = (
        default_object(vessel, np.array([0.0, 1.2, 0.0]), 30.0),
        default_object(kind, np.array([0.0, 2.2, 0.0])),
    )
    if kind == "Pencil":  # upright
        item.box_size, item.box_center = (
            item.box_size[[0, 2, 1]],
            np.array([0.0, item.box_size[2] / 2, 0.0]),
        )
    for new in (around, item):
        bench.sim.world.add(new)
    (cavity,) = surfaces(around)
    bench.ok("PlaceObjectAtPoint", item.object_id, position=to_xyz(cavity.center))
    assert bench.object(item.object_id)["parentReceptacles"] == [around.object_id]
    assert bottom(bench, item.object_id) == pytest.approx(cavity.center[1], abs=1e-4)
    rim = cavity.center + np.array([around.box_size[0] / 2, 0.0, 0.0])
    assert around.name in bench.refused("PlaceObjectAtPoint", item.object_id, position=to_xyz(rim))
    below = cavity.center - [0.0, 0.05, 0.0]
    assert around.name in bench.refused(
        "PlaceObjectAtPoint", item.object_id, position=to_xyz(below)
    )


def test_a_closed_box_is_solid_and_so_is_what_is_too_small(bench):
    carton = default_object("Box", np.array([0.0, 1.2, 0.0]))
    bowl = default_object("Bowl", np.array([0.0, 1.2, 0.0]))
    for new in (carton, bowl):
        bench.sim.world.add(new)
    inside = to_xyz(surfaces(carton)[0].center)
    bench.ok("PlaceObjectAtPoint", bowl.object_id, position=inside)
    bench.ok("PlaceObjectAtPoint", bowl.object_id, position={**inside, "y": 2.0})
    bench.force("CloseObject", carton.object_id)
    assert carton.name in bench.refused("PlaceObjectAtPoint", bowl.object_id, position=inside)
    bread = default_object("Bread", np.array([0.0, 2.2, 0.0]))
    bench.sim.world.add(bread)
    within = to_xyz(surfaces(bowl)[0].center)
    assert bowl.name in bench.refused("PlaceObjectAtPoint", bread.object_id, position=within)


def test_a_held_object_can_be_placed(bench):
    apple = bench.first("Apple")
    bench.force("PickupObject", apple)
    free_point(bench, bench.first("DiningTable"), apple)
    assert bench.metadata["inventoryObjects"] == []


def test_points_above_a_receptacle(bench):
    table = bench.first("DiningTable")
    points = bench.ok("GetSpawnCoordinatesAboveReceptacle", table)["actionReturn"]
    low, high = bench.sim.world.objects[table].bounds()
    assert len(points) > 50
    assert all(low[0] <= p["x"] <= high[0] and low[2] <= p["z"] <= high[2] for p in points)
    bench.stand_before(table)
    seen = bench.ok("GetSpawnCoordinatesAboveReceptacle", table, anywhere=False)["actionReturn"]
    assert len(seen) < len(points)
    assert "not a receptacle" in bench.refused(
        "GetSpawnCoordinatesAboveReceptacle", bench.first("Apple")
    )


def test_a_teleported_object_falls_unless_it_is_kinematic(bench):
    apple = bench.first("Apple")
    agent = bench.metadata["agent"]["position"]
    high = {"x": agent["x"], "y": 2.0, "z": agent["z"]}
    still = {"x": 0, "y": 0, "z": 0}
    bench.ok("TeleportObject", apple, position=high, rotation=still, forceKinematic=True)
    assert bench.object(apple)["position"] == pytest.approx(high)
    bench.ok("TeleportObject", apple, rotation=still, **high)
    assert bottom(bench, apple) == pytest.approx(0, abs=0.01)
    wall = {"x": 50, "y": 2.0, "z": 0}
    assert "in the way" in bench.refused("TeleportObject", apple, position=wall, rotation=still)
    bench.ok("TeleportObject", apple, positions=[wall, high], rotation=still, forceKinematic=True)
    assert bench.object(apple)["position"] == pytest.approx(high)


def test_a_held_object_is_teleported_on_demand_only(bench):
    apple = bench.first("Apple")
    bench.force("PickupObject", apple)
    place = {
        "objectId": apple,
        "position": {"x": 0, "y": 2, "z": 0},
        "rotation": {"y": 0},
        "forceAction": True,
    }
    assert "in hand" in bench.refused("TeleportObject", **place)
    bench.ok("TeleportObject", **place, allowTeleportOutOfHand=True)
    assert bench.metadata["inventoryObjects"] == []


def test_furniture_can_be_teleported(bench):
    fridge = bench.first("Fridge")
    pose = bench.object(fridge)
    aside = {**pose["position"], "x": pose["position"]["x"] + 0.1}
    bench.force("TeleportObject", fridge, position=aside, rotation=pose["rotation"])
    assert bench.object(fridge)["position"] == pytest.approx(aside)


def test_a_disabled_object_is_gone_until_it_is_enabled(bench):
    mug, table = bench.first("Mug"), bench.first("DiningTable")
    free_point(bench, table, mug)
    before = bench.object(mug)
    bench.ok("DisableObject", mug)
    assert mug not in {o["objectId"] for o in bench.metadata["objects"]}
    assert mug not in bench.object(table)["receptacleObjectIds"]
    bench.refused("PickupObject", mug, forceAction=True)
    bench.ok("EnableObject", mug)
    assert bench.object(mug)["position"] == before["position"]
    assert bench.object(mug)["parentReceptacles"] == [table]
    bench.ok("EnableObject", mug)
    bench.refused("EnableObject", "Mug|+09.00|+09.00|+09.00")


def test_contents_of_a_disabled_receptacle_return_to_it(bench):
    world = bench.sim.world
    drawer = next(o for o in world.objects.values() if o.object_type == "Drawer" and o.contents)
    inside = list(drawer.contents)
    bench.ok("DisableObject", drawer.object_id)
    assert all(bench.object(content)["parentReceptacles"] is None for content in inside)
    bench.ok("EnableObject", drawer.object_id)
    assert set(inside) <= set(bench.object(drawer.object_id)["receptacleObjectIds"])


@pytest.mark.parametrize("angle", [0, 90, 180, 270, -90])
def test_a_push_goes_the_way_of_its_angle(bench, angle):
    apple, place = in_the_open(bench)
    bench.ok("RotateLook", rotation={"y": 90})
    bench.force("DirectionalPush", apple, pushAngle=angle, moveMagnitude=15)
    now = bench.object(apple)["position"]
    way = np.array([now["x"] - place["x"], now["z"] - place["z"]])
    direction = np.array([np.sin(np.radians(90 + angle)), np.cos(np.radians(90 + angle))])
    assert way @ direction > 0.02
    assert (
        abs(way @ direction[::-1] * (1, -1)[0]) < 1e-6
        or np.linalg.norm(way - direction * (way @ direction)) < 1e-6
    )


def in_the_open(bench: Bench) -> tuple[str, dict[str, float]]:
    """An apple on the free floor, and where it lies."""
    apple = bench.first("Apple")
    world = bench.sim.world
    x, z = max(
        world.nav,
        key=lambda c: sum(world.nav.count_free_ahead(*c, yaw) for yaw in (0.0, 90.0, 180.0, 270.0)),
    )
    still = {"x": 0, "y": 0, "z": 0}
    bench.force("TeleportObject", apple, x=x, y=1.0, z=z, rotation=still)
    return apple, bench.object(apple)["position"]


def test_a_stronger_push_goes_farther_and_nothing_goes_through_walls(bench):
    low, high = bench.sim.world.scene_bounds()
    ways = []
    for force in (5, 15, 100000):
        apple, place = in_the_open(bench)
        bench.force("PushObject", apple, moveMagnitude=force)
        now = bench.object(apple)["position"]
        ways.append(np.hypot(now["x"] - place["x"], now["z"] - place["z"]))
        assert low[0] <= now["x"] <= high[0]
        assert low[2] <= now["z"] <= high[2]
    assert ways == sorted(ways)
    assert ways[0] < ways[2]


def test_pushed_off_the_edge_it_falls(bench):
    table, apple = bench.first("DiningTable"), bench.first("Apple")
    free_point(bench, table, apple)
    level = bottom(bench, apple)
    for angle in (0, 90, 180, 270):
        bench.force("DirectionalPush", apple, pushAngle=angle, moveMagnitude=60)
        if bottom(bench, apple) < level - 0.2:
            assert bench.object(apple)["parentReceptacles"] != [table]
            return
    pytest.fail("it never left the table")


def test_what_cannot_be_pushed(bench):
    assert "Pickupable or Moveable" in bench.refused(
        "PushObject", bench.first("Fridge"), forceAction=True
    )
    apple = bench.first("Apple")
    bench.refused("PullObject", apple, moveMagnitude=0, forceAction=True)
    bench.force("PickupObject", apple)
    assert "Throw" in bench.refused("PullObject", apple, forceAction=True)


def test_a_push_leaves_things_in_what_is_closed(bench):
    world = bench.sim.world
    inside = next(o for o in world.objects.values() if world.is_hidden(o) and o.type.pickupable)
    outer = inside.parent
    bench.force("PushObject", inside.object_id, moveMagnitude=500)
    assert bench.object(inside.object_id)["parentReceptacles"] == [outer]


def test_a_thing_teleported_into_the_tray_of_an_open_drawer_is_in_it_and_goes_with_it(bench):
    world = bench.sim.world
    drawer = next(o for o in world.objects.values() if o.object_type == "Drawer" and o.contents)
    item = next(o for o in world.objects.values() if o.object_id in drawer.contents)
    bench.force("OpenObject", drawer.object_id, openness=1.0)
    out = bench.object(item.object_id)
    aside = {**out["position"], "y": out["position"]["y"] + 1.0}
    for position in (aside, out["position"]):
        bench.ok(
            "TeleportObject", objectId=item.object_id, position=position, rotation=out["rotation"],
            forceAction=True, forceKinematic=True,
        )  # fmt: skip
    assert (
        bench.object(item.object_id)["parentReceptacles"]
        == out["parentReceptacles"]
        == [drawer.object_id]
    )
    bench.force("CloseObject", drawer.object_id)
    assert bench.object(item.object_id)["position"] != out["position"]


@pytest.mark.parametrize("scene", ["kitchen-2", "kitchen-3", "kitchen-5"])
def test_a_push_takes_what_is_in_its_way_along_and_nothing_through_it(scene):
    bench = Bench.at(scene, size=60)
    world = bench.sim.world
    table = world.objects[bench.first("DiningTable")]
    low, high = table.bounds()
    first = default_object("Apple", np.zeros(3))
    second = default_object("Tomato", np.zeros(3))
    for item in world.children(table):
        world.remove(item)
    for number, item in enumerate((first, second)):
        item.place_bottom(
            np.array([(low[0] + high[0]) / 2, table.surface_height(), low[2] + 0.2 + 0.2 * number])
        )
        item.object_id = f"{item.object_type}|pushed"
        world.add(item)
        world.attach(item, table)
    gap = second.bounds()[0][2] - first.bounds()[1][2]
    angle = -bench.metadata["agent"]["rotation"]["y"]  # towards +z
    bench.force("DirectionalPush", first.object_id, pushAngle=angle, moveMagnitude=20)
    first = world.objects["Apple|pushed"]
    second = world.objects["Tomato|pushed"]
    assert gap > 0.02
    assert second.position[2] > low[2] + 0.41, "it was pushed along"
    assert second.bounds()[0][2] > first.bounds()[1][2] - 0.006, "and not gone through"


@pytest.mark.parametrize("kind", ["Cabinet", "Drawer", "Fridge", "Microwave"])
def test_nothing_is_put_into_closed_furniture_unless_forced(bench, kind):
    furniture, apple = bench.first(kind, isOpen=False), bench.first("Apple")
    inside = bench.object(furniture)["axisAlignedBoundingBox"]["center"]
    pose = {"objectId": apple, "position": inside}
    name = bench.object(furniture)["name"]
    assert bench.refused("TeleportObject", **pose, rotation={}).startswith(name)
    assert f"({name} is in the way)" in bench.refused("PlaceObjectAtPoint", **pose)
    bench.force("TeleportObject", **pose, rotation={})


def test_what_is_dropped_ahead_lands_in_front_of_the_agent(bench):
    potato = bench.first("Potato")
    assert "Nothing in agent's hand" in bench.refused("DropHeldObjectAhead")
    bench.force("PickupObject", potato)
    bench.force("DropHeldObjectAhead", autoSimulation=False, randomMagnitude=0.0)
    away = (
        np.array(list(bench.object(potato)["position"].values())) - bench.sim.world.agent.position
    )
    assert float(np.hypot(away[0], away[2])) > 1.0
