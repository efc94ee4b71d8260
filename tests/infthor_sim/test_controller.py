"""The unmodified Controller against the simulator: handshake, pictures, errors."""

import numpy as np
import pytest
from ai2thor.util import metrics

from .conftest import need_data


def test_first_state_has_frame_depth_and_ids(kitchen):
    event = kitchen.last_event
    assert event.frame.shape == (300, 300, 3)
    assert event.depth_frame.shape == (300, 300)
    assert event.metadata["sceneName"] == "kitchen-1"
    assert len(event.metadata["objects"]) > 35
    shown = [name for name in event.instance_masks if "|" in name]
    assert shown, "no object is in view"
    assert {o["objectId"] for o in event.metadata["objects"]} >= set(shown)


def test_moves_and_turns(kitchen):
    before = kitchen.last_event.metadata["agent"]
    after = kitchen.step("RotateRight").metadata["agent"]
    assert after["rotation"]["y"] == (before["rotation"]["y"] + 90) % 360
    listed = kitchen.step("GetReachablePositions").metadata["actionReturn"]
    cells = {(p["x"], p["z"]) for p in listed}
    assert (before["position"]["x"], before["position"]["z"]) in cells
    moved = kitchen.step("MoveAhead")
    at = moved.metadata["agent"]["position"]
    assert moved.metadata["lastActionSuccess"] == (
        (round(at["x"], 2), round(at["z"], 2)) != (0.0, 0.0)
    )
    assert (at["x"], at["z"]) in cells


def test_unknown_action_and_argument_raise_in_the_client(kitchen):
    with pytest.raises(ValueError, match="Invalid action"):
        kitchen.step("FlyAhead")
    with pytest.raises(ValueError, match="speedy"):
        kitchen.step("MoveAhead", speedy=2)
    with pytest.raises(ValueError, match="sceneName"):
        kitchen.step("Reset")
    assert kitchen.last_event.metadata["errorCode"] == "MissingArguments"


def test_look_limits(kitchen):
    assert kitchen.step("LookDown", degrees=15).metadata["agent"]["cameraHorizon"] == 15
    kitchen.step("LookDown")
    kitchen.step("LookDown", degrees=15)
    refused = kitchen.step("LookDown", degrees=15)
    assert not refused.metadata["lastActionSuccess"]
    assert refused.metadata["errorCode"] == "LookDownCantExceedMin"
    assert refused.metadata["agent"]["cameraHorizon"] == 60


def test_unknown_scene_is_one_clear_error(kitchen):
    """ai2thor's Controller refuses what is not listed; what it lets through, the simulator does."""
    with pytest.raises(ValueError, match="'FloorPlan1_physics' not contained in build"):
        kitchen.reset("FloorPlan1")
    kitchen._scenes_in_build = set()
    with pytest.raises(RuntimeError, match="FloorPlan1 needs recorded data"):
        kitchen.reset("FloorPlan1")
    kitchen._scenes_in_build = None


def test_a_controller_starts_without_a_scene(launch):
    controller = launch(None)
    assert controller.last_event.metadata["lastActionSuccess"]
    assert {"kitchen-1", "bathroom-1000", "house-1"} < controller.scenes_in_build
    assert controller.reset("kitchen-1").metadata["sceneName"] == "kitchen-1"


def test_a_controller_with_data_starts_in_a_floor_plan(launch):
    controller = launch(None, "--data", str(need_data()))
    assert controller.scene == "FloorPlan11_physics"
    assert len(controller.last_event.metadata["objects"]) > 30
    recorded = {name for name in controller.scenes_in_build if name.startswith("FloorPlan")}
    assert len(recorded) == 116


def test_damaged_data_are_named_when_a_scene_is_loaded(launch, tmp_path):
    (tmp_path / "thor_scenes").mkdir()
    (tmp_path / "thor_scenes" / "objects.jsonl.gz").write_bytes(b"no archive")
    with pytest.raises(RuntimeError, match=r"objects.jsonl.gz: cannot be read"):
        launch("FloorPlan1", "--data", str(tmp_path))


def test_the_quality_of_the_controller_decides_on_smooth_edges(launch, kitchen):
    smooth = kitchen.last_event
    jagged = launch("kitchen-1", quality="Low").last_event
    assert np.array_equal(smooth.depth_frame, jagged.depth_frame)
    assert np.array_equal(smooth.instance_segmentation_frame, jagged.instance_segmentation_frame)
    assert not np.array_equal(smooth.frame, jagged.frame), "the Controller's own default is Ultra"


def test_same_seed_same_bytes(kitchen):
    first = kitchen.reset("kitchen-5")
    again = kitchen.reset("kitchen-5")
    assert np.array_equal(first.frame, again.frame)
    assert first.metadata["objects"] == again.metadata["objects"]


def test_the_shortest_ways_of_ai2thor_s_metrics(kitchen):
    objects = kitchen.last_event.metadata["objects"]
    start = kitchen.last_event.metadata["agent"]["position"]
    turn = {"x": 0, "y": 90, "z": 0}
    fridge = next(o for o in objects if o["objectType"] == "Fridge")
    name, at = fridge["objectId"], fridge["axisAlignedBoundingBox"]["center"]
    plain = metrics.get_shortest_path_to_object(kitchen, name, start)
    assert len(plain) > 1
    assert metrics.get_shortest_path_to_object(kitchen, name, start, turn) == plain
    assert metrics.get_shortest_path_to_object_type(kitchen, "Fridge", start, turn) == plain
    to_end = metrics.get_shortest_path_to_point(kitchen, start, plain[-1])
    assert to_end[-1] == plain[-1]
    assert metrics.path_distance(to_end) == pytest.approx(metrics.path_distance(plain))
    with pytest.raises(ValueError, match="No point on NavMesh"):  # it is within the fridge
        metrics.get_shortest_path_to_point(kitchen, start, at)
