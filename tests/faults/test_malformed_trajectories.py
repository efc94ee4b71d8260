"""A trajectory that cannot be read leaves the others to be replayed."""

import json
import os

import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import DiscreteAction, HighAction, PlannerAction
from infthor_eval.generation.replay_set import select
from infthor_eval.household.sequence_text import plan_text
from infthor_eval.storage.limits import OBJECT_POSES


def _trajectory(**changes):
    scene = {"floor_plan": "kitchen-1", "init_action": {"x": 0.0, "y": 0.9, "z": 0.0}}
    turn = {"api_action": {"action": "RotateLeft"}, "high_idx": 0}
    return {"scene": scene, "plan": {"low_actions": [turn]}, "traj_id": "sound"} | changes


def _odd_turn():
    turn = {
        "api_action": {"action": "RotateLeft"},
        "discrete_action": {"action": "Rotate_²", "args": {}},
    }
    return json.dumps(_trajectory(plan={"low_actions": [turn]})).encode()


def _posed(n_poses):
    pose = {"objectName": "Plate_1", "position": {"x": 0.0, "y": 0.9, "z": 0.0}}
    sound = _trajectory()
    return json.dumps(
        sound | {"scene": sound["scene"] | {"object_poses": [pose] * n_poses}}
    ).encode()


MALFORMED = {
    "object poses without end": _posed(100_000),
    "no JSON": b"{",
    "deep": b"[" * 200_000,
    "of another form": b"[]",
    "a turn by no number": _odd_turn(),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_trajectory_leaves_the_others_to_be_replayed(tmp_path, name):
    (tmp_path / "a.json").write_bytes(MALFORMED[name])
    (tmp_path / "b.json").write_text(json.dumps(_trajectory()))
    selected = select([tmp_path])
    assert [trajectory.traj_id for _, trajectory in selected.items] == ["sound"]
    assert [failure.place for failure in selected.failures] == [str(tmp_path / "a.json")]
    assert selected.failures[0].message.count(str(tmp_path)) == 1


def test_as_many_poses_as_the_limit_are_read(tmp_path, monkeypatch):
    (tmp_path / "a.json").write_bytes(_posed(3))
    monkeypatch.setenv(OBJECT_POSES.name, "3")
    assert len(select([tmp_path]).items) == 1
    monkeypatch.setenv(OBJECT_POSES.name, "2")
    (failure,) = select([tmp_path]).failures
    assert (
        f"3 object_poses are too many for a scene; if this is intended, set {OBJECT_POSES.name}"
        in failure.message
    )


@pytest.mark.parametrize("damage", [os.mkfifo, lambda path: path.write_bytes(b"no gzip")])
def test_a_file_that_cannot_be_read_leaves_the_others_to_be_replayed(tmp_path, damage):
    damage(tmp_path / "a.jsonl.gz")
    (tmp_path / "b.json").write_text(json.dumps(_trajectory()))
    selected = select([tmp_path])
    assert len(selected.items) == 1
    assert [failure.place for failure in selected.failures] == [str(tmp_path / "a.jsonl.gz")]


@pytest.mark.parametrize("action", ["{0.__class__}", "{", "{0:>9999999999}", "{missing}", "%s{}"])
def test_a_format_string_in_a_plan_is_a_name(action):
    high = HighAction(0, DiscreteAction(action, ["mug"]), PlannerAction("x"))
    assert plan_text(high, Words.NATURAL) == action
    assert plan_text(high, Words.PUBLISHED) == ""
