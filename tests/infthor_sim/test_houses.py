"""ProcTHOR houses: through CreateHouse, as the Controller sends them."""

import gzip
import json
from typing import Any

import pytest

from infthor_sim.errors import DataError
from infthor_sim.scenes.catalogue import Catalogue

from .harness import Bench
from .schema import check


def point(x: float, z: float, y: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def wall(room: str, x0: float, z0: float, x1: float, z1: float) -> dict[str, Any]:
    polygon = [point(x0, z0), point(x1, z1), point(x1, z1, 2.7), point(x0, z0, 2.7)]
    name = f"wall|{room}|{x0}|{z0}|{x1}|{z1}"
    return {"id": name, "roomId": room, "polygon": polygon, "material": {"name": "A"}}


def room(name: str, room_type: str, *corners: tuple[float, float]) -> dict[str, Any]:
    floor = [point(*c) for c in corners]
    return {"id": name, "roomType": room_type, "floorPolygon": floor, "ceilings": []}


def furniture(
    name: str, asset: str, x: float, y: float, z: float, yaw: float = 0, children: Any = ()
) -> dict[str, Any]:
    return {"id": name, "assetId": asset, "position": point(x, z, y),
            "rotation": {"x": 0, "y": yaw, "z": 0},
            "kinematic": True, "children": list(children)}  # fmt: skip


def house() -> dict[str, Any]:
    """A kitchen of L shape and a bedroom, joined by a doorway."""
    kitchen = room("room|2", "Kitchen", (0, 0), (0, 6), (3, 6), (3, 4), (5, 4), (5, 0))
    bedroom = room("room|3", "Bedroom", (5, 0), (5, 4), (9, 4), (9, 0))
    walls = [
        wall("room|2", 0, 0, 0, 6), wall("room|2", 0, 6, 3, 6), wall("room|2", 3, 6, 3, 4),
        wall("room|2", 3, 4, 5, 4),
        wall("room|2", 5, 0, 5, 4), wall("room|2", 5, 0, 0, 0), wall("room|3", 5, 0, 5, 4),
        wall("room|3", 5, 4, 9, 4),
        wall("room|3", 9, 4, 9, 0), wall("room|3", 9, 0, 5, 0), wall("exterior", 0, 0, 0, 6),
    ]  # fmt: skip
    door = {
        "id": "door|2|3",
        "assetId": "Doorway_1",
        "openable": True,
        "openness": 1,
        "room0": "room|2",
        "room1": "room|3",
        "wall0": walls[4]["id"],
        "wall1": walls[6]["id"],
        "holePolygon": [point(1.0, 0), point(2.0, 0, 2.1)],
    }
    apple = furniture("Apple|surface|2|4", "Apple_11", 1.0, 0.86, 2.0)
    objects = [
        furniture("Fridge|2|1", "Fridge_11", 0.5, 0.93, 5.4, 180),
        furniture("DiningTable|2|2", "Dining_Table_21_2", 1.0, 0.4, 2.0, 0, [apple]),
        furniture("Bed|3|1", "Bed_1", 7.5, 0.45, 2.9, 180),
    ]
    agent = {"position": point(2.5, 2.5, 0.95), "rotation": {"x": 0, "y": 270, "z": 0}}
    agent |= {"horizon": 30, "standing": True}
    parts = {"rooms": [kitchen, bedroom], "walls": walls, "doors": [door], "windows": []}
    about = {"metadata": {"agent": agent, "schema": "1.0.0"}, "proceduralParameters": {}}
    return {**parts, "objects": objects, **about}


def furnished_house() -> dict[str, Any]:
    """The same with things to do in it."""
    made = house()
    table = next(o for o in made["objects"] if o["id"].startswith("DiningTable"))
    table["children"] += [
        furniture("Mug|surface|2|9", "Mug_1", 0.8, 0.86, 2.2),
        furniture("Plate|surface|2|11", "Plate_1", 1.3, 0.83, 2.2),
    ]
    book = furniture("Book|surface|3|1", "Book_1", 8.6, 0.75, 0.5)
    made["objects"] += [
        furniture("Microwave|2|6", "Microwave_1", 4.6, 1.05, 0.4),
        furniture("SideTable|3|2", "Side_1", 8.6, 0.35, 0.5, children=[book]),
    ]
    return made


def test_objects_of_a_house_keep_their_ids():
    bench = Bench.at("Procedural", size=20)
    bench.ok("CreateHouse", house=furnished_house())
    before = {o["objectId"] for o in bench.metadata["objects"]}
    loose = [
        {"objectName": o["name"], "position": o["position"], "rotation": o["rotation"]}
        for o in bench.metadata["objects"]
        if o["pickupable"]
    ]
    bench.ok("SetObjectPoses", objectPoses=loose)
    assert {o["objectId"] for o in bench.metadata["objects"]} == before
    bench.ok("InitialRandomSpawn", randomSeed=3)
    assert {o["objectId"] for o in bench.metadata["objects"]} == before
    bench.ok("SetObjectPoses", objectPoses=[loose[0], loose[0]])
    named = [o["objectId"] for o in bench.metadata["objects"] if o["pickupable"]]
    first = loose[0]["objectName"]
    assert named == [first, f"{first}_copy_1"]


def test_a_house_through_the_controller(launch):
    controller = launch(house())
    event = controller.last_event
    check(event.metadata)
    objects = {o["objectId"]: o for o in event.metadata["objects"]}
    assert set(objects) >= {"Fridge|2|1", "DiningTable|2|2", "Bed|3|1", "room|2", "room|3"}
    assert objects["Apple|surface|2|4"]["parentReceptacles"] == ["DiningTable|2|2"]
    assert event.metadata["agent"]["position"]["x"] == pytest.approx(2.5, abs=0.13)
    assert event.metadata["agent"]["cameraHorizon"] == 30
    listed = controller.step("GetReachablePositions").metadata["actionReturn"]
    cells = {(p["x"], p["z"]) for p in listed}
    assert (6.0, 1.5) in cells, "the doorway joins the rooms"
    assert (4.0, 5.0) not in cells, "outside the L"
    opened = controller.step("OpenObject", objectId="Fridge|2|1", forceAction=True)
    assert opened.metadata["lastActionSuccess"]


def with_door(**values: Any) -> Bench:
    made = house()
    made["doors"][0] |= values
    bench = Bench.at("Procedural", size=100)
    bench.ok("CreateHouse", house=made)
    return bench


@pytest.mark.parametrize("openness", [0, 1])
@pytest.mark.parametrize(("width", "asset"), [(1.0, "Doorway_1"), (2.0, "Doorway_Double_7")])
def test_a_closed_door_keeps_the_agent_out_and_an_open_one_lets_it_through(openness, width, asset):
    hole = [point(1.0, 0), point(1.0 + width, 0, 2.1)]
    bench = with_door(openness=openness, holePolygon=hole, assetId=asset)
    middle = 1.0 + width / 2
    bench.teleport(4.0, middle, 90)
    door = bench.object("door|2|3")
    assert (door["objectType"], door["openable"], door["isOpen"]) == (
        "Doorway",
        True,
        openness == 1,
    )
    assert door["visible"]
    box, leaf = door["axisAlignedBoundingBox"], width if width == 1 else width / 2
    assert box["center"]["z"] == pytest.approx(middle, abs=0.05)
    assert box["size"]["z"] == pytest.approx(width, abs=0.1)
    assert box["size"]["x"] == pytest.approx(0.17 + openness * leaf, abs=0.02)

    def crosses() -> bool:
        bench.teleport(4.0, middle, 90)
        return all(bench.step("MoveAhead")["lastActionSuccess"] for _ in range(8))

    def reaches() -> bool:
        bench.teleport(2.5, 2.5)
        cells = bench.ok("GetReachablePositions")["actionReturn"]
        return any(cell["x"] > 6 for cell in cells)

    assert crosses() == reaches() == (openness == 1)
    bench.force("CloseObject" if openness else "OpenObject", "door|2|3")
    assert crosses() == reaches() == (openness == 0)


def test_a_door_opens_into_its_first_room_and_hits_nobody():
    bench = with_door(openness=0)
    bench.teleport(4.5, 1.5, 90)
    assert "failed to open/close" in bench.refused("OpenObject", "door|2|3")
    assert not bench.object("door|2|3")["isOpen"]
    # What sets all states moves nothing through the room, and one door keeps no other thing back.
    bench.ok("SetObjectStates", SetObjectStates={"stateChange": "openable", "isOpen": True})
    assert all(o["isOpen"] for o in bench.metadata["objects"] if o["openable"])
    bench.ok("SetObjectStates", SetObjectStates={"stateChange": "openable", "isOpen": False})
    bench.teleport(5.5, 1.5, 270)  # on the other side, with the door's back in view
    bench.ok("OpenObject", "door|2|3")


@pytest.mark.parametrize(
    "values", [{"openable": False, "openness": 0}, {"assetId": "Doorframe_3"}], ids=str
)
def test_what_cannot_be_opened_says_so(values):
    bench = with_door(**values)
    bench.teleport(4.0, 1.5, 90)
    frame = values.get("assetId", "").startswith("Doorframe")
    door = bench.object("door|2|3")
    assert (door["objectType"], door["openable"]) == ("Doorframe" if frame else "Doorway", False)
    assert "not an Openable object" in bench.refused("OpenObject", "door|2|3", forceAction=True)
    assert bench.sim.world.nav.can_stand(5.0, 1.5) == frame


def test_without_its_doorway_the_rooms_are_apart():
    closed = house() | {"doors": []}
    world = Catalogue().house(closed)
    reached = world.nav.reachable_cells(world.agent.position[0], world.agent.position[2])
    assert all(x < 5 for x, _ in reached)


def test_assets_have_their_sizes_where_the_folder_has_them(tmp_path):
    (tmp_path / "procthor").mkdir()
    path = tmp_path / "procthor" / "asset-database.json.gz"
    fridge = {"assetId": "Fridge_11", "boundingBox": {"x": 0.8, "y": 1.7, "z": 0.7}}
    path.write_bytes(gzip.compress(json.dumps({"Fridge": [fridge]}).encode()))
    world = Catalogue(tmp_path).house(house())
    assert world.objects["Fridge|2|1"].box_size.tolist() == [0.8, 1.7, 0.7]
    path.write_bytes(gzip.compress(b"[1]"))
    with pytest.raises(DataError, match="asset-database"):
        Catalogue(tmp_path).house(house())


MALFORMED = {
    "without rooms": lambda bad: bad.pop("rooms"),
    "without walls": lambda bad: bad.pop("walls"),
    # Python has such an integer, and no such float
    "beyond numbers": lambda bad: bad["walls"][0]["polygon"][0].update(x=10**400),
    "a name that no message carries": lambda bad: bad["objects"][0].update(id="Fridge|\ud800"),
}


@pytest.mark.parametrize("fault", MALFORMED)
def test_malformed_houses_are_refused(fault):
    bench = Bench.at("Procedural", size=20)
    bad = house()
    MALFORMED[fault](bad)
    assert "ProcTHOR" in bench.refused("CreateHouse", house=bad)
    bench.ok("CreateHouse", house=house())


@pytest.mark.parametrize("far", [1e30, float("nan"), -201.0])
def test_floors_without_end_are_refused_at_once(far):
    bad = house()
    bad["rooms"][1]["floorPolygon"][2]["z"] = far
    with pytest.raises(DataError, match="a floor reaches to"):
        Catalogue().house(bad)


def test_an_error_may_quote_what_no_message_carries():
    bench = Bench.at("Procedural", size=20)
    assert "\\ud800" in bench.refused("CreateHouse", house="\ud800")
