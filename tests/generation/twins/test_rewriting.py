"""Trajectories written for another world."""

import pytest

from infthor_eval.formats.trajectory import (
    ApiAction,
    StartState,
    encode_trajectory,
    iter_trajectories,
)
from infthor_eval.generation.twins.rewriting import (
    exchange_ids,
    in_world,
    whole_of,
    with_inserted,
    without_traces,
)

from ...helpers.trajectories import FORK


@pytest.fixture
def trajectory(file):
    return next(iter_trajectories(file))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Apple|1|1|1", "Tomato|2|2|2"),
        ("Apple|1|1|1|AppleSliced_3", "Tomato|2|2|2|TomatoSliced_3"),
        ("Sink|1|1|1|SinkBasin", "Sink|1|1|1|SinkBasin"),
        ("Apple|3|3|3", "Apple|3|3|3"),
    ],
)
def test_slices_go_with_their_wholes(old, new):
    assert exchange_ids({"Apple|1|1|1": "Tomato|2|2|2"})(old) == new


def test_the_whole_of_a_slice():
    assert whole_of("Apple|1|1|1|AppleSliced_3") == whole_of("Apple|1|1|1") == "Apple|1|1|1"


def test_names_in_tasks_and_words_are_exchanged(trajectory):
    world = in_world(trajectory, trajectory.scene, types={"Fork": "Spoon", "Spoon": "Fork"})
    assert "fork" in trajectory.sub_tasks[0].task_desc
    assert "spoon" in world.sub_tasks[0].task_desc
    assert world.sub_trajs[0].subgoal == world.sub_tasks[0].task_desc
    assert trajectory.sub_tasks[0].task_info.pickup == "Fork"  # the given one is left as it is


def test_inserted_actions_belong_to_the_task_that_they_are_in(trajectory):
    longer = with_inserted(trajectory, 2, [ApiAction("LookUp"), ApiAction("LookDown")])
    lows = longer.plan.low_actions
    assert [low.api_action.action for low in lows[2:4]] == ["LookUp", "LookDown"]
    assert [low.low_idx for low in lows] == list(range(len(trajectory.plan.low_actions) + 2))
    assert longer.sub_trajs[0].low_pddl_idx == (0, trajectory.sub_trajs[0].low_pddl_idx[1] + 2)


def test_what_tells_where_a_trajectory_comes_from_is_left_out(trajectory):
    text = encode_trajectory(without_traces(trajectory, "neutral")).decode()
    assert FORK not in text
    assert "bbox" not in text


def test_start_states_are_written_only_where_there_are_any(trajectory, tmp_path):
    assert b"object_states" not in encode_trajectory(trajectory)
    trajectory.scene.object_states = [StartState("Drawer_1", is_open=True)]
    path = tmp_path / "one.json"
    path.write_bytes(encode_trajectory(trajectory))
    assert next(iter_trajectories(path)).scene.object_states == trajectory.scene.object_states
