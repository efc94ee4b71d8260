import gzip
import json
from pathlib import Path

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import encode_trajectory, iter_sources, iter_trajectories

SHARED = Path(__file__).parents[2] / "../shared/data"
MINIMAL = {
    "scene": {
        "floor_plan": "FloorPlan1",
        "init_action": {"x": 0, "y": 0.9, "z": 1.5, "rotation": 90},
    },
    "plan": {"low_actions": [{"api_action": {"action": "MoveAhead"}}]},
    "something_new": 1,
}


def read_one(path, **changes):
    """The trajectory that is read of the smallest document, changed."""
    return next(iter_trajectories(write(path, MINIMAL | changes)))


def write(path, *documents):
    text = "".join(json.dumps(document) + "\n" for document in documents).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return path


@pytest.mark.parametrize("name", ["a.json", "a.jsonl", "a.jsonl.gz"])
def test_every_container_reads(tmp_path, name):
    trajectory = read_one(tmp_path / name)
    assert trajectory.scene.init_action.yaw == 90
    assert trajectory.plan.low_actions[0].api_action.action == "MoveAhead"
    assert trajectory.traj_id.startswith("a")


def test_vector_rotation(tmp_path):
    turned = MINIMAL["scene"]["init_action"] | {"rotation": {"y": 270.0}}
    scene = MINIMAL["scene"] | {"init_action": turned}
    assert read_one(tmp_path / "a.json", scene=scene).scene.init_action.yaw == 270


def test_directory_in_order_without_the_sets_own_files(tmp_path):
    for name in ("b.json", "a.json", "metadata.json", "expert_log.json"):
        write(tmp_path / name, {**MINIMAL, "traj_id": name})
    names = [trajectory.traj_id for trajectory in iter_trajectories(tmp_path)]
    assert names == ["a.json", "b.json"]


@pytest.mark.parametrize("name", ["replay.json", "set.json", "status.json", "timeline.json"])
def test_reports_of_replays_and_of_the_published_generator_are_no_trajectories(tmp_path, name):
    write(tmp_path / "floorplan1_3_40_1.json", MINIMAL)
    write(tmp_path / name, {"scene": 1, "phase": "sampling"})
    (trajectory,) = iter_trajectories(tmp_path)
    assert trajectory.traj_id == "floorplan1_3_40_1"


def test_a_malformed_line_is_named_and_hides_no_other(tmp_path):
    path = write(tmp_path / "a.jsonl", MINIMAL, {"scene": 1}, MINIMAL)
    sources = list(iter_sources(path))
    assert len(sources) == 3
    with pytest.raises(DataError, match=r"a\.jsonl:2: not a trajectory.*scene"):
        sources[1].read()
    sources[2].read()


def test_cut_off_files(tmp_path):
    path = tmp_path / "a.jsonl.gz"
    path.write_bytes(gzip.compress(json.dumps(MINIMAL).encode() * 100)[:-20])
    with pytest.raises(DataError, match="cannot be read after line"):
        list(iter_trajectories(path))
    (tmp_path / "b.json").write_bytes(json.dumps(MINIMAL).encode()[:-10])
    with pytest.raises(DataError, match=r"b\.json: not a trajectory"):
        list(iter_trajectories(tmp_path / "b.json"))


@pytest.mark.parametrize("name", ["missing.json", "missing.jsonl", "missing.txt"])
def test_missing_files(tmp_path, name):
    with pytest.raises(DataError, match=name.replace(".", r"\.")):
        list(iter_trajectories(tmp_path / name))


def test_written_reads_back(tmp_path):
    trajectory = read_one(tmp_path / "a.json")
    (tmp_path / "b.json").write_bytes(encode_trajectory(trajectory))
    assert next(iter_trajectories(tmp_path / "b.json")) == trajectory


def test_what_the_published_saver_leaves_empty(tmp_path):
    scene = {**MINIMAL["scene"], "floor_plan": "", "scene_num": 28, "dirty_and_empty": None}
    trajectory = read_one(tmp_path / "a.json", scene=scene, long_horizon_task={})
    assert (trajectory.scene.floor_plan, trajectory.scene.dirty_and_empty) == ("FloorPlan28", False)
    assert trajectory.long_horizon_task is None


def test_keys_that_readers_of_published_trajectories_look_up_are_always_written(tmp_path):
    document = json.loads(encode_trajectory(read_one(tmp_path / "a.json")))
    assert document["long_horizon_task"] == {}
    assert document["sub_tasks"] == document["sub_trajs"] == []


@pytest.mark.parametrize("document", [[], {"scene": {"scene_num": 1}}, {"scene": 3}, {}])
def test_what_is_no_trajectory_is_one_line(tmp_path, document):
    with pytest.raises(DataError, match=r"a\.json: not a trajectory") as error:
        next(iter_trajectories(write(tmp_path / "a.json", document)))
    assert "\n" not in str(error.value)


@pytest.mark.skipif(not SHARED.is_dir(), reason="recorded data not at ../shared/data")
def test_recorded_alfred_trajectories_read():
    trajectories = list(iter_trajectories(SHARED / "alfred/valid_seen.jsonl.gz"))
    assert len(trajectories) == 251
    first = trajectories[0]
    assert first.scene.floor_plan == "FloorPlan323"
    assert first.plan.high_pddl[1].planner_action.object_id == "AlarmClock|+02.69|+01.23|+01.40"
    pickup = next(low for low in first.plan.low_actions if low.api_action.action == "PickupObject")
    assert pickup.discrete_action.box == (159, 1, 268, 143)
