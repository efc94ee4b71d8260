"""Every reply's metadata has the form of AI2-THOR 5.x."""

import re
from pathlib import Path

import numpy as np
import pytest

from infthor_sim.actions import action_names
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.settings import AGENT_MODES

from .conftest import need_data
from .harness import Bench
from .schema import check

_ID = re.compile(r"[A-Za-z]+(\|[+-]?\d\d\.\d\d){3}(\|[A-Za-z]+(_\d+)?)?")


def test_through_the_controller(kitchen):
    event = kitchen.reset("kitchen-3")
    for action in ("Pass", "MoveAhead", "RotateRight", "LookDown", "MoveBack"):
        event = kitchen.step(action)
        check(event.metadata)
        assert event.metadata["lastAction"] == action


@pytest.mark.parametrize(
    "scene", ["kitchen-2", "living-room-2", "bedroom-2", "bathroom-2", "house-2"]
)
def test_every_kind_of_scene(scene):
    bench = Bench()
    metadata = bench.reset(scene)
    check(metadata)
    ids = [o["objectId"] for o in metadata["objects"]]
    assert len(ids) == len(set(ids))
    assert all(_ID.fullmatch(i) for i in ids)


def test_nulls_where_not_applicable(bench):
    apple, fridge = bench.object(bench.first("Apple")), bench.object(bench.first("Fridge"))
    assert apple["receptacleObjectIds"] is None
    assert apple["objectOrientedBoundingBox"] is not None
    assert isinstance(fridge["receptacleObjectIds"], list)
    assert fridge["parentReceptacles"] is None


def test_boxes_contain_the_position_of_upright_things():
    bench = Bench()
    for item in bench.reset("bedroom-4")["objects"]:
        box = item["axisAlignedBoundingBox"]
        corners = box["cornerPoints"]
        for index, axis in enumerate("xyz"):
            low, high = min(c[index] for c in corners), max(c[index] for c in corners)
            assert low == pytest.approx(box["center"][axis] - box["size"][axis] / 2, abs=2e-4)
            assert high == pytest.approx(box["center"][axis] + box["size"][axis] / 2, abs=2e-4)


def test_ids_are_printed_as_unity_prints_them():
    from infthor_sim.geometry import object_id

    for position, printed in (
        ((2.6857, 1.2324, 1.3974), "+02.69|+01.23|+01.40"),
        ((-1.96499991, 0.593926966, 0.9192637), "-01.97|+00.59|+00.92"),
        ((0.705, -0.00154149532, -2.75), "+00.71|00.00|-02.75"),
        ((0.0, 0.0, 0.0), "+00.00|+00.00|+00.00"),
    ):
        assert object_id("Cloth", position) == f"Cloth|{printed}"


def test_the_scene_has_the_name_of_its_physics_scene():
    bench = Bench(Catalogue(need_data()), size=20)
    for name in ("FloorPlan28", "FloorPlan28_physics"):
        assert bench.reset(name)["sceneName"] == "FloorPlan28_physics"
    assert bench.reset("kitchen-1")["sceneName"] == "kitchen-1"
    assert bench.ok("Reset", sceneName="Procedural")["sceneName"] == "Procedural"


@pytest.mark.parametrize("object_type", ["Fridge", "Drawer", "Cabinet", "Microwave"])
def test_a_box_holds_the_open_door(bench, object_type):
    name = bench.first(object_type)
    closed = bench.object(name)["axisAlignedBoundingBox"]
    bench.force("OpenObject", name, openness=0.5)
    half = bench.object(name)["axisAlignedBoundingBox"]
    bench.force("OpenObject", name)
    wide = bench.object(name)["axisAlignedBoundingBox"]
    assert closed["size"] != half["size"] != wide["size"]
    low = np.min(wide["cornerPoints"], axis=0)
    assert (low <= np.min(closed["cornerPoints"], axis=0)).all()
    bench.force("CloseObject", name)
    assert bench.object(name)["axisAlignedBoundingBox"] == closed


def test_open_object_takes_the_old_name_of_openness(bench):
    fridge = bench.first("Fridge")
    for magnitude, openness in ((0.65, 0.65), (0, 1.0)):
        bench.force("OpenObject", fridge, moveMagnitude=magnitude)
        assert bench.object(fridge)["openness"] == openness
    for wrong in (-0.5, 1.5):
        assert "must be in" in bench.refused("OpenObject", fridge, openness=wrong, forceAction=True)


def test_time_passes_with_actions():
    bench = Bench(size=20)
    start = bench.reset("kitchen-1")["currentTime"]
    assert start == 0.04  # Reset and Initialize
    assert bench.ok("GetReachablePositions")["currentTime"] == start
    assert bench.ok("Pass")["currentTime"] == 0.06
    bench.refused("PickupObject", "Mug|none")
    assert bench.metadata["currentTime"] == 0.08
    for _ in range(50):
        bench.ok("RotateRight")
    assert bench.metadata["currentTime"] == 1.08
    assert bench.reset("kitchen-1")["currentTime"] == start


def test_the_size_of_the_map_is_told_once():
    bench = Bench(size=20)
    assert bench.ok("Reset", sceneName="kitchen-1")["cameraOrthSize"] == 0
    assert bench.ok("Initialize", fastActionEmit=False)["cameraOrthSize"] == 0
    size = bench.ok("GetMapViewCameraProperties")["actionReturn"]["orthographicSize"]
    assert bench.metadata["cameraOrthSize"] == -1
    assert bench.ok("ToggleMapView")["cameraOrthSize"] == size
    assert bench.ok("Pass")["cameraOrthSize"] == -1
    assert bench.ok("ToggleMapView")["cameraOrthSize"] == -1


def test_old_keys_are_there_and_empty(kitchen):
    metadata = kitchen.last_event.metadata
    assert metadata["actionIntReturn"] == metadata["actionFloatReturn"] == 0
    assert metadata["visibleRange"] is metadata["colorBounds"] is None
    lists = {"distances", "normals", "flatSurfacesOnGrid", "isOpenableGrid", "segmentedObjectIds"}
    lists |= {"objectIdsInBox", "actionFloatsReturn", "actionStringsReturn", "actionVector3sReturn"}
    assert all(metadata[key] == [] for key in lists)


def test_every_action_is_described():
    text = (Path(__file__).resolve().parents[2] / "infthor_sim" / "ACTIONS.md").read_text(
        encoding="utf-8"
    )
    assert [
        name for mode in AGENT_MODES for name in action_names(mode) if f"`{name}`" not in text
    ] == []
