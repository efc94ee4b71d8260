"""`show` of trajectory files: ours, published ones, ALFRED's."""

import json
from itertools import pairwise

import pytest

from tests.helpers.command_line import assert_refused, read_success
from tests.helpers.trajectories import MUG, cut_trajectory, write_trajectories
from tests.plans.put_away import PEN, pen_put_away

# `gen_info` as the published generator of July 2026 writes it, and a field that nobody knows
PUBLISHED = {
    "banked_on_giveup": True,
    "created": 1785283200,
    "git": "81d82c8",
    "look_around": False,
    "max_fail": 20,
    "min_step": 1,
    "min_subgoal": 2,
    "replay_every": 5,
    "sample_seeds": [3203951, None, 17],
    "save_floor": 300,
    "scene": 301,
    "scene_goal_filter": True,
    "seed": None,
    "something else": {"a": [1, 2]},
}


@pytest.fixture
def published(tmp_path):
    """A file with a put-down, and what the published generator says of itself."""
    folder = write_trajectories(tmp_path / "data", pen_put_away() | {"gen_info": PUBLISHED})
    (file,) = folder.iterdir()
    return file


def test_a_published_trajectory_is_shown(published, run_cli):
    code, out, err = run_cli("show", published)
    assert (code, err) == (0, "")
    first, *lines = out.splitlines()
    assert first.split(", ")[1:] == ["99 steps", "3 sub-goals"] and PEN in first
    rows = [
        line.split(None, 4) for line in lines if line.split(None, 1)[:1] in (["0"], ["1"], ["2"])
    ]
    assert [row[0] for row in rows] == ["0", "1", "2"]
    assert "put the Pen on the DiningTable" in out
    assert "put object" in out
    for name, value in PUBLISHED.items():
        assert f"{name}: {json.dumps(value)}" in lines


def test_its_json_has_the_ranges_and_gen_info_as_it_is(published, run_cli):
    code, out, _ = run_cli("show", published, "--json")
    (shown,) = json.loads(out)
    assert code == 0 and shown["gen_info"] == PUBLISHED
    parts = shown["sub_goals"]
    assert [part["goal"] for part in parts][1] == "put object"
    assert parts[0]["first"] == 0 and parts[-1]["end"] == shown["steps"]
    assert all(one["end"] == two["first"] for one, two in pairwise(parts))


def test_one_without_gen_info_and_with_a_final_task_is_shown(run_cli, tmp_path):
    document = cut_trajectory(MUG, 4, final=True)
    del document["gen_info"]
    folder = write_trajectories(tmp_path / "data", document)
    (file,) = folder.iterdir()
    code, out, _ = run_cli("show", file)
    assert code == 0 and "(final task)" in out and "min_step" not in out


def test_a_demonstration_of_alfred_is_one_sub_goal(run_cli, tmp_path):
    document = {
        "scene": {"floor_plan": "FloorPlan1", "init_action": {"x": 0, "y": 1, "z": 0}},
        "plan": {"low_actions": [{"api_action": {"action": "MoveAhead"}}] * 3},
        "task_id": "trial_1",
        "task_type": "pick_and_place_simple",
        "turk_annotations": {"anns": [{"task_desc": "Put a mug away."}]},
    }
    (tmp_path / "traj_data.json").write_text(json.dumps(document))
    out, _ = read_success(run_cli("show", tmp_path / "traj_data.json"))
    assert "trial_1: scene FloorPlan1, 3 steps, 1 sub-goal\n" in out
    assert "0-2" in out and "Put a mug away." in out


@pytest.mark.parametrize("options", [("--full",), ("--format", "csv"), ("--per-sample",)])
def test_options_of_runs_are_refused(published, run_cli, options):
    assert_refused(run_cli("show", published, *options), "are for runs")


def test_runs_and_trajectories_are_not_shown_together(published, run_cli, tmp_path):
    assert_refused(run_cli("show", published, tmp_path), "a call of their own")


def test_another_json_file_is_no_trajectory(run_cli, tmp_path):
    (tmp_path / "results.json").write_text("{}")
    assert_refused(run_cli("show", tmp_path / "results.json"), "not a trajectory")
