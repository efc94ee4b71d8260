"""Procedural rooms are furnished by type, connected, and different from seed to seed."""

import numpy as np
import pytest

from infthor_sim.physics.solids import part_boxes
from infthor_sim.scenes import procedural
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.scenes.procedural import SCENE_TYPES

from .harness import Bench

NEEDED = {
    "kitchen": "Fridge Microwave CounterTop SinkBasin Faucet Cabinet Drawer DiningTable "
    "StoveBurner CoffeeMachine Knife"
    " Mug Plate Apple Tomato Potato Egg Pan Pot GarbageCan",
    "living-room": "Sofa CoffeeTable TVStand Television FloorLamp Drawer ArmChair GarbageCan",
    "bedroom": "Bed Desk DeskLamp Dresser Drawer SideTable Chair",
    "bathroom": "Toilet Bathtub BathtubBasin SinkBasin Faucet CounterTop Cabinet SoapBar Cloth "
    "TowelHolder",
}


@pytest.mark.parametrize("room_type", sorted(NEEDED))
@pytest.mark.parametrize("seed", range(5))
def test_furniture_of_the_room_type(room_type, seed):
    world = Catalogue().load(f"{room_type}-{seed}")
    missing = set(NEEDED[room_type].split()) - {o.object_type for o in world.objects.values()}
    assert not missing
    assert 35 <= len(world.objects) <= 80
    at = world.agent.position
    assert len(world.nav.reachable_cells(at[0], at[2])) == len(world.nav)


STANDING = {"DeskLamp", "Television", "Microwave", "CoffeeMachine", "Toaster", "Faucet"}
STANDING |= {"StoveBurner"}


@pytest.mark.parametrize(
    "scene", ["living-room-2", "bedroom-2", "kitchen-1", "kitchen-2", "bathroom-1"]
)
def test_nothing_stands_in_another_thing(scene):
    world = Catalogue().load(scene)
    loose = [o for o in world.objects.values() if o.type.pickupable and not world.is_hidden(o)]
    for item in loose:
        for other in world.objects.values():
            apart = (
                other is item or other.object_id == item.parent or item.object_id == other.parent
            )
            if apart or not (other.type.pickupable or other.object_type in STANDING):
                continue
            boxes = [other.bounds()] if other.type.pickupable else part_boxes(other)
            for low, high in boxes:
                overlap = np.minimum(item.bounds()[1], high) - np.maximum(item.bounds()[0], low)
                assert overlap.min() < 0.004, f"{item.object_id} stands in {other.object_id}"


@pytest.mark.parametrize("scene_type", SCENE_TYPES)
def test_names_are_reproducible_and_seeds_differ(scene_type):
    first = Catalogue().load(f"{scene_type}-3")
    again = Catalogue().load(f"{scene_type}-3")
    other = Catalogue().load(f"{scene_type}-4")
    assert list(first.objects) == list(again.objects)
    assert list(first.objects) != list(other.objects)


@pytest.mark.parametrize("room_type", sorted(NEEDED))
def test_what_hangs_and_is_only_drawn_takes_nothing_from_a_room(room_type, monkeypatch):
    decorated = Catalogue().load(f"{room_type}-3")
    monkeypatch.setattr(procedural, "decorate", lambda *_: None)
    bare = Catalogue().load(f"{room_type}-3")
    assert set(decorated.nav) == set(bare.nav)
    more = {key for key in decorated.objects if key not in bare.objects}
    assert {decorated.objects[key].object_type for key in more} == {"Painting"}
    assert set(bare.objects) < set(decorated.objects)
    pictures = [decorated.objects[key].bounds() for key in more]
    for low, high in pictures:
        for other in decorated.objects.values():
            apart = np.maximum(low - other.bounds()[1], other.bounds()[0] - high).max()
            assert apart > -1e-6 or other.object_id in more
    (room,) = decorated.rooms
    assert room.rug is not None
    side, at = room.door
    bench = Bench.at(f"{room_type}-3")
    for item in bench.metadata["objects"]:  # nothing stands before the door
        box = item["axisAlignedBoundingBox"]
        across, along = ("x", "z") if side[0] == "x" else ("z", "x")
        wall = getattr(room, f"{across}_{'max' if side[1] == '+' else 'min'}")
        near = abs(box["center"][across] - wall) - box["size"][across] / 2 < 0.4
        beside = abs(box["center"][along] - at) - box["size"][along] / 2 < 0.4
        assert not (near and beside and box["size"]["y"] > 0.2), item["objectId"]


def test_the_doors_of_a_house_open_close_and_keep_the_agent_out():
    bench = Bench.at("house-3")
    doors = [o for o in bench.metadata["objects"] if o["objectType"] == "Doorway"]
    assert [door["isOpen"] for door in doors] == [True] * 3

    def n_cells() -> int:
        return len(bench.ok("GetReachablePositions")["actionReturn"])

    before = n_cells()
    for door in doors:
        bench.force("CloseObject", door["objectId"])
    alone = n_cells()
    assert alone < before / 2
    for door in doors:
        bench.force("OpenObject", door["objectId"])
    assert n_cells() == before


@pytest.mark.parametrize("seed", [2, 5])
def test_a_house_is_connected(seed):
    world = Catalogue().load(f"house-{seed}")
    assert len(world.rooms) == 4
    for room in world.rooms:
        assert any(
            room.x_min < x < room.x_max and room.z_min < z < room.z_max for x, z in world.nav
        )


@pytest.mark.parametrize(
    "task",
    [
        "pick Apple put CounterTop", "pick Mug heat Microwave put DiningTable",
        "pick Apple cool Fridge put CounterTop",
        "pick Plate clean SinkBasin put CounterTop", "pick Knife slice Tomato put CounterTop",
    ],
)  # fmt: skip
def test_tasks_can_be_done_by_an_agent_that_must_see(task):
    bench = Bench.at("kitchen-2", size=150)
    _, what, *rest = task.split()
    pick(bench, what)
    for verb, target in zip(rest[::2], rest[1::2], strict=True):
        VERBS[verb](bench, target)
    assert bench.metadata["inventoryObjects"] == []


def pick(bench: Bench, object_type: str) -> str:
    """Picks up the first object of a type that the agent gets to see."""
    item = bench.first(object_type)
    open_around(bench, item)
    bench.stand_before(item)
    bench.ok("PickupObject", item)
    return item


def open_around(bench: Bench, object_id: str) -> None:
    """Opens what an object is shut in."""
    item = bench.sim.world.objects[object_id]
    if bench.sim.world.is_hidden(item):
        bench.stand_before(item.parent)
        bench.ok("OpenObject", item.parent)


def put(bench: Bench, object_type: str) -> str:
    target = bench.first(object_type)
    bench.stand_before(target)
    bench.ok("PutObject", target)
    return target


def store(bench: Bench, object_type: str) -> tuple[str, str]:
    """Opens, puts, closes; returns what was stored and where."""
    target, item = bench.first(object_type), bench.metadata["inventoryObjects"][0]["objectId"]
    bench.stand_before(target)
    bench.ok("OpenObject", target)
    bench.ok("PutObject", target)
    bench.ok("CloseObject", target)
    return item, target


def heat(bench: Bench, object_type: str) -> None:
    item, target = store(bench, object_type)
    bench.ok("ToggleObjectOn", target)
    bench.ok("ToggleObjectOff", target)
    fetch(bench, item, target, "Hot")


def cool(bench: Bench, object_type: str) -> None:
    item, target = store(bench, object_type)
    fetch(bench, item, target, "Cold")


def fetch(bench: Bench, item: str, target: str, temperature: str) -> None:
    bench.ok("OpenObject", target)
    bench.stand_before(item)
    bench.ok("PickupObject", item)
    bench.force("CloseObject", target)
    assert bench.object(item)["temperature"] == temperature


def clean(bench: Bench, object_type: str) -> None:
    item = bench.metadata["inventoryObjects"][0]["objectId"]
    bench.ok("DirtyObject", item)
    target = put(bench, object_type)
    faucet = bench.first("Faucet")
    bench.stand_before(faucet)
    bench.ok("ToggleObjectOn", faucet)
    bench.ok("ToggleObjectOff", faucet)
    assert not bench.object(item)["isDirty"]
    bench.stand_before(target)
    bench.ok("PickupObject", item)


def cut(bench: Bench, object_type: str) -> None:
    target = bench.first(object_type)
    open_around(bench, target)
    bench.stand_before(target)
    bench.ok("SliceObject", target)


VERBS = {"put": put, "heat": heat, "cool": cool, "clean": clean, "slice": cut}
