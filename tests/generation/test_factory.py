"""Algorithm 1 on the embedded simulator: what holds between tasks and at the end."""

from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.factory import generate
from infthor_eval.generation.final_task import violation
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.tasks import TaskType
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

SHARED = Path(__file__).parents[2] / "../shared/data"


@pytest.fixture(scope="module")
def simulator():
    with Simulator(embedded_launch()) as simulator:
        yield simulator


def test_every_task_begins_with_an_empty_hand(simulator):
    # What was looked at is still in the hand, and is put down between the tasks.
    made = generate(TrajectorySettings("bedroom-3", 0, 60, 3, task_types=(TaskType.EXAMINE,)), simulator)
    trajectory = made.trajectory
    assert [entry["step"] for entry in trajectory.object_log] == list(range(len(trajectory.plan.low_actions) + 1))
    for part in trajectory.sub_trajs:
        assert trajectory.object_log[part.low_pddl_idx[0]]["inven_obj"] == []
    assert trajectory.object_log[-1]["inven_obj"] == []
    assert len(trajectory.plan.high_pddl) > sum(len(range(*part.high_pddl_idx)) for part in trajectory.sub_trajs)
    assert sum(made.statistics.tried.values()) >= sum(made.statistics.accepted.values()) == len(made.problems) >= 3


def test_sub_goals_and_actions_are_numbered_through(simulator):
    trajectory = generate(TrajectorySettings("living-room-2", 5, 60, 4), simulator).trajectory
    plan = trajectory.plan
    assert [high.high_idx for high in plan.high_pddl] == list(range(len(plan.high_pddl))) and len(plan.high_pddl) >= 4
    assert [low.low_idx for low in plan.low_actions] == list(range(len(plan.low_actions)))
    assert len(plan.low_actions) >= 60
    owners = [low.high_idx for low in plan.low_actions]
    assert owners == sorted(owners) and set(owners) == set(range(len(plan.high_pddl)))
    ends = [0]
    for part in trajectory.sub_trajs:
        first, end = part.low_pddl_idx
        assert ends[-1] <= first < end <= len(plan.low_actions)
        assert all(part.high_pddl_idx[0] <= owner < part.high_pddl_idx[1] for owner in owners[first:end])
        ends.append(end)


def test_the_final_task_is_about_both_ends_and_comes_last(simulator):
    trajectory = generate(TrajectorySettings("kitchen-2", 3, 60, 1, final_task=True), simulator).trajectory
    assert violation(trajectory) is None
    assert len(trajectory.sub_trajs) == len(trajectory.sub_tasks)
    assert trajectory.sub_tasks[-1] == trajectory.long_horizon_task
    assert trajectory.sub_trajs[-1].subgoal == trajectory.long_horizon_task.task_desc
    assert trajectory.sub_trajs[-1].low_pddl_idx[1] == len(trajectory.plan.low_actions)


@pytest.mark.parametrize(("scene", "seed"), [("living-room-3", 2), ("FloorPlan317", 0)])
def test_looking_for_places_leaves_no_trace(scene, seed, tmp_path):
    # In the floor plan an open drawer is out of sight from where it was opened to look into it.
    data = SHARED if scene.startswith("FloorPlan") else None
    if data is not None and not data.is_dir():
        pytest.skip("recorded floor plans not at ../shared/data")
    with Simulator(embedded_launch(data)) as simulator:
        (path,) = generate_set([TrajectorySettings(scene, seed, 150, 1)], simulator, tmp_path / "trajectories").paths
    with Simulator(embedded_launch(data)) as simulator:
        summary = summarise(replay_set(select([path]), simulator, tmp_path / "set"))
    assert summary.complete == 1, summary.diverged
    trajectory = next(iter_trajectories(path))
    made = [{key: value for key, value in entry.items() if key != "step"} for entry in trajectory.object_log]
    steps = read_steps(tmp_path / "set" / "metadata" / trajectory.traj_id)
    assert made == [msgspec.to_builtins(step.object_log) for step in steps]


def test_the_lengths_are_in_steps_and_tasks_and_failures_have_an_end(simulator):
    made = generate(TrajectorySettings("living-room-2", 1, 1, 3), simulator)
    assert len(made.trajectory.sub_tasks) == len(made.trajectory.sub_trajs) == 3
    with pytest.raises(UsageError, match=r"and 2 failed tasks \(PutObject: .*or a higher --max-fail"):
        generate(TrajectorySettings("living-room-2", 0, 100_000, 1, max_fail=2), simulator)


def test_a_task_type_that_the_room_offers_nothing_for_is_one_line(simulator):
    with pytest.raises(UsageError, match=r"scene living-room-1, seed 0: no further task works after 0 steps") as error:
        generate(TrajectorySettings("living-room-1", 0, 10, 1, task_types=(TaskType.HEAT,)), simulator)
    assert "\n" not in str(error.value)
