"""Floor plans from any data folder of the documented form, and what trajectories add."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from infthor_sim.errors import DataError
from infthor_sim.geometry import level_gaps
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.scenes.supplement import read_supplement

from .conftest import need_data
from .harness import Bench


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A data folder with one floor plan: a procedural kitchen as the metadata reports it."""
    bench = Bench.at("kitchen-1", size=40)
    entries = bench.metadata["objects"]
    for entry in entries:  # the public form has boxes without corner points
        entry["axisAlignedBoundingBox"].pop("cornerPoints")
    (tmp_path / "thor_scenes").mkdir()
    (tmp_path / "alfred" / "layouts").mkdir(parents=True)
    scenes = ({"scene": f"FloorPlan{number}", "objects": entries} for number in (901, 902))
    write_objects(tmp_path, "\n".join(map(json.dumps, scenes)))
    cells = np.array(list(bench.sim.world.nav))
    np.save(tmp_path / "alfred" / "layouts" / "FloorPlan901-layout.npy", cells)
    return tmp_path


def write_objects(folder: Path, lines: str) -> None:
    path = folder / "thor_scenes" / "objects.jsonl.gz"
    path.write_bytes(gzip.compress(f"{lines}\n".encode()))


def supplement(folder: Path, **entry: object) -> Path:
    path = folder / "supplement.json"
    path.write_text(json.dumps({"FloorPlan901": entry}), encoding="utf-8")
    return path


def test_a_scene_survives_being_written_and_read(folder):
    original, copy = Bench(size=40), Bench(Catalogue(folder), size=40)
    before = {o["objectId"]: o for o in original.reset("kitchen-1")["objects"]}
    after = {o["objectId"]: o for o in copy.reset("FloorPlan901_physics")["objects"]}
    assert set(before) == set(after)
    for name, item in before.items():
        for key in ("objectType", "pickupable", "openable", "isOpen", "isToggled", "mass"):
            assert after[name][key] == item[key], (name, key)
        old, new = (objects[name]["axisAlignedBoundingBox"] for objects in (before, after))
        for part in ("center", "size"):
            assert new[part] == pytest.approx(old[part], abs=2e-3), (name, part)
    lying = [n for n, o in before.items() if o["parentReceptacles"] and o["pickupable"]]
    same = [n for n in lying if after[n]["parentReceptacles"] == before[n]["parentReceptacles"]]
    assert len(same) == len(lying)
    cells = copy.ok("GetReachablePositions")["actionReturn"]
    assert len(cells) == len(original.ok("GetReachablePositions")["actionReturn"])


def test_missing_data_are_named(folder, tmp_path):
    for catalogue, scene, message in (
        (Catalogue(), "FloorPlan901", "--data"),
        (Catalogue(tmp_path / "nowhere"), "FloorPlan901", "nowhere"),
        (Catalogue(folder), "FloorPlan55", "has no FloorPlan55"),
        (Catalogue(folder), "FloorPlan902", "nowhere to stand"),
        (Catalogue(folder, tmp_path / "none.json"), "FloorPlan901", "none.json"),
        (Catalogue(folder), "castle-1", "castle-1"),
    ):
        bench = Bench(catalogue, size=20)
        assert message in bench.refused("Reset", sceneName=scene)
        assert message in bench.refused("Initialize"), "the client reads only Initialize's answer"
        bench.ok("Reset", sceneName="kitchen-1")


@pytest.mark.parametrize(
    "line",
    [
        '{"scene":"FloorPlan901"}',
        '{"scene":"FloorPlan901","objects":[{"objectId":"A"}]}',
        '{"scene":"FloorPlan901","objects":[{"objectId":"A|1|1|1","position":{"x":1%s}}]}'
        % ("0" * 400),
        "[1]",
    ],
)
def test_malformed_objects_are_named(folder, line):
    write_objects(folder, line)
    with pytest.raises(DataError):
        Catalogue(folder).load("FloorPlan901")


def test_a_supplement_adds_cells_height_and_objects(folder):
    plain = Catalogue(folder).load("FloorPlan901")
    fridge = next(o for o in plain.objects.values() if o.object_type == "Fridge")
    x, y, z = fridge.position
    table = next(o for o in plain.objects.values() if o.object_type == "DiningTable")
    ids = [
        f"Fridge|{x + 0.04:+06.2f}|{y:+06.2f}|{z:+06.2f}",
        f"Desk|{table.position[0]:+06.2f}|+00.70|{table.position[2]:+06.2f}",
        "Dresser|+01.00|+00.02|-01.00",
        "Mug|+00.00|+01.00|+00.00",
    ]
    path = supplement(folder, cells=[[5.0, 5.0]], floor_y=1.25, objects=ids)
    world = Catalogue(folder, path).load("FloorPlan901")
    assert world.nav.can_stand(5.0, 5.0)
    assert world.agent.position[1] == 1.25
    assert ids[0] in world.objects
    assert fridge.object_id not in world.objects
    assert world.objects[ids[1]].object_type == "Desk"
    assert table.object_id not in world.objects
    assert world.objects[ids[2]].type.receptacle
    assert ids[3] not in world.objects, "loose objects come with a trajectory's own poses"


@pytest.mark.parametrize("content", ["[]", "{", '{"A": {"cells": [1]}}', '{"A": 3}'])
def test_malformed_supplements_are_named(tmp_path, content):
    path = tmp_path / "s.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(DataError, match=r"s\.json"):
        read_supplement(path)


def test_poses_rearrange_the_loose_objects(folder):
    bench = Bench.at("FloorPlan901", catalogue=Catalogue(folder), size=40)
    mug = bench.object(bench.first("Mug"))
    table = bench.object(bench.first("DiningTable"))["axisAlignedBoundingBox"]
    top = table["center"]["y"] + table["size"]["y"] / 2
    here = {**table["center"], "y": top, "z": table["center"]["z"] + 0.1}
    there = {**here, "z": table["center"]["z"] - 0.25}
    bench.ok(
        "SetObjectPoses",
        objectPoses=[
            {"objectName": mug["name"] + "(Clone)", "position": here,
             "rotation": {"x": 0, "y": 90, "z": 0}},
            {"objectName": mug["name"], "position": there, "rotation": {"x": 0, "y": 0, "z": 0}},
            {"objectName": "AlarmClock_ead726ec", "position": {"x": 0.5, "y": 0.1, "z": 0.5},
             "rotation": {}},
        ],
    )  # fmt: skip
    loose = [o for o in bench.metadata["objects"] if o["pickupable"]]
    assert sorted(o["objectType"] for o in loose) == ["AlarmClock", "Mug", "Mug"]
    ids = {o["objectId"] for o in loose}
    assert "AlarmClock|+00.50|+00.10|+00.50" in ids
    mugs = [o for o in loose if o["objectType"] == "Mug"]
    assert {o["parentReceptacles"][0].split("|")[0] for o in mugs} == {"DiningTable"}
    for place in (None, "", [0, 1, 0], {"x": math.inf}, {"x": 10**400}, {"w": 1}, {"x": "1"}):
        bench.refused("SetObjectPoses", objectPoses=[{"objectName": "Mug_1", "position": place}])
    bench.refused("SetObjectPoses", objectPoses=[{"objectName": "Mug_1"}])
    bench.refused("SetObjectPoses", objectPoses=["Mug_1"])


def test_toggles_and_states_of_all(folder):
    bench = Bench.at("FloorPlan901", catalogue=Catalogue(folder), size=40)
    bench.ok("SetObjectToggles", objectToggles=[{"objectType": "LightSwitch", "isOn": False}])
    assert not bench.object(bench.first("LightSwitch"))["isToggled"]
    bench.force("SetStateOfAllObjects", StateChange="CanBeDirty")
    assert all(o["isDirty"] for o in bench.metadata["objects"] if o["dirtyable"])
    bench.ok("SetStateOfAllObjects", StateChange="CanBeFilled", forceAction=False)
    assert not any(o["isFilledWithLiquid"] for o in bench.metadata["objects"])
    opened = {"objectType": "Drawer", "stateChange": "openable", "isOpen": True}
    bench.ok("SetObjectStates", SetObjectStates=opened)
    assert all(o["isOpen"] for o in bench.metadata["objects"] if o["objectType"] == "Drawer")
    bench.refused("SetStateOfAllObjects", StateChange="CanBeMagic")


def test_the_agent_stands_on_free_floor_beside_cells(folder):
    cells = np.load(folder / "alfred" / "layouts" / "FloorPlan901-layout.npy")
    bench, taken = Bench(Catalogue(folder), size=20), set()
    for last in np.unique(cells[:, 0])[1:-1]:  # as if nothing were known of what is behind it
        np.save(
            folder / "alfred" / "layouts" / "FloorPlan902-layout.npy", cells[cells[:, 0] <= last]
        )
        bench.reset("FloorPlan902")
        world = bench.sim.world
        height = float(world.agent.position[1])
        boxes = [o.bounds() for o in world.objects.values() if o.object_type != "Floor"]
        stops = [b for b in boxes if b[1][1] > 0.1 and b[0][1] < 1.8]  # from knee to head
        beside_doors = {z for x, z in world.nav if x > last}  # cells that no layout has
        for x, z in (cell for cell in world.nav if cell[0] == last and cell[1] not in beside_doors):
            room = min(float(level_gaps(np.array([x + 0.22, z]), *box)) for box in stops)
            ends = {step: {"x": x + step, "y": height, "z": z} for step in (0.22, 0.25)}
            (bench.ok if room >= 0.2 else bench.refused)("Teleport", position=ends[0.22])
            bench.refused("Teleport", position=ends[0.25])
            taken.add(room >= 0.2)
    assert taken == {True, False}


# Starts of the base set of EB-Navigation (EmbodiedBench), in AI2-THOR 5.
@pytest.mark.parametrize(
    ("number", "x", "z"),
    [(12, 0.6, 2.9), (19, -0.8, -1.0), (27, 0.2, -0.7), (212, 1.2, -0.1), (215, -1.3, 7.2),
     (225, -1.4, 2.7), (311, 0.6, 4.1), (316, 1.4, 0.1), (321, 3.4, 1.2), (328, 1.6, 0.7)],
)  # fmt: skip
def test_starts_of_ai2thor_between_cells_are_taken(number, x, z):
    world = Catalogue(need_data()).load(f"FloorPlan{number}")
    assert world.nav.can_stand(x, z)


def test_a_put_in_a_recording_goes_through_nothing_unless_it_is_forced():
    bench = Bench(Catalogue(need_data()), size=100)
    bench.reset("FloorPlan301")
    mug, dresser = bench.first("Mug"), bench.first("Dresser")
    bench.force("PickupObject", mug)
    poses = bench.ok("GetInteractablePoses", dresser)["actionReturn"]
    bench.ok("TeleportFull", **{**poses[0], "rotation": {"y": poses[0]["rotation"]}})
    assert "No valid positions" in bench.refused("PutObject", dresser)
    bench.force("PutObject", dresser)
