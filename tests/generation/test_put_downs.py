"""Putting down what a task left in the hand: a sub-goal of its own, as published in July 2026."""

import json
from pathlib import Path

import msgspec
import pytest

from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import encode_trajectory
from infthor_eval.generation.factory import generate
from infthor_eval.generation.look_around import INSERTED
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.questions.put_action import further_puts, puts
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.household.planner import plan
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import TaskType
from infthor_eval.plans.environment import PlanEnvironment
from infthor_eval.plans.plan import PlanKind, plans_of, tasks_of

PUBLISHED = Path(__file__).parents[1] / "goldens" / "put_downs.jsonl"
SETTINGS = TrajectorySettings("bedroom-3", 0, 1, 6, task_types=(TaskType.EXAMINE,))


@pytest.fixture(scope="module")
def made(simulator):
    return generate(SETTINGS, simulator)


@pytest.fixture(scope="module")
def replayed(made, simulator, tmp_path_factory):
    """The log of a replay without a refused action."""
    folder = tmp_path_factory.mktemp("put_downs")
    (folder / "made.json").write_bytes(encode_trajectory(made.trajectory))
    assert summarise(replay_set(select([folder]), simulator, folder / "set")).complete == 1
    return folder / "set" / "metadata" / made.trajectory.traj_id


def put_downs(trajectory):
    """The indices of the put-downs among the tasks."""
    goals = [task.task_info.goal for task in trajectory.sub_tasks]
    return [number for number, goal in enumerate(goals) if goal == TaskType.PUT_AWAY]


@pytest.mark.parametrize("golden", PUBLISHED.read_text().splitlines())
def test_its_fields_are_the_published_ones(made, golden):
    """The published document of a put-down, with the names of ours in place of its own."""
    published = json.loads(golden)
    ours = msgspec.to_builtins(made.trajectory)
    for number in put_downs(made.trajectory):
        part = ours["sub_trajs"][number]
        high = ours["plan"]["high_pddl"][slice(*part["high_pddl_idx"])]
        low = ours["plan"]["low_actions"][slice(*part["low_pddl_idx"])]
        (put,) = (action for action in low if action["api_action"]["action"] == "PutObject")
        names = {
            published["held"].split("|")[0]: put["api_action"]["objectId"].split("|")[0],
            published["place"]: put["api_action"]["receptacleObjectId"].split("|")[0],
            '"301"': '"bedroom-3"',
        }
        expected = _renamed(published["sub_tasks"][1], names)
        expected["pddl_params"] = ours["sub_tasks"][number - 1]["pddl_params"]
        assert ours["sub_tasks"][number] == expected
        assert part["subgoal"] == expected["task_desc"]
        assert high == [
            _renamed(published["high_pddl"][1], names) | {"high_idx": high[0]["high_idx"]}
        ]
        assert {action["high_idx"] for action in low} == {high[0]["high_idx"]}
        call = dict(published["low_actions"][-1]["api_action"])
        del call["renderImage"]
        assert put["api_action"].keys() == call.keys()
    assert published["sub_tasks"][1]["pddl_params"] == published["sub_tasks"][0]["pddl_params"]


def _renamed(document, names):
    text = json.dumps(document)
    for published, ours in names.items():
        text = text.replace(published, ours)
    return json.loads(text)


def test_what_is_written_of_its_generation_has_the_published_fields(made):
    published = json.loads(PUBLISHED.read_text().splitlines()[0])["gen_info"]
    info = made.trajectory.gen_info
    assert published.keys() <= info.keys()
    assert info["sample_seeds"] == [0, None] * 3
    assert [seed is None for seed in published["sample_seeds"]] == [False, True]


def test_it_has_a_problem_like_any_task(made):
    assert len(made.problems) == len(made.trajectory.sub_tasks) == 6
    for number in put_downs(made.trajectory):
        assert f"(define (problem task-{number:03d})" in made.problems[number]
        assert "(asked-put-object)" in made.problems[number]


def test_it_is_planned_and_the_expert_completes_it(made, simulator):
    trajectory = made.trajectory
    environment = PlanEnvironment(trajectory, simulator)
    plans = plans_of(trajectory, Words.PUBLISHED)
    tasks = tasks_of(trajectory)
    put_away = [one for one in plans if one.task in put_downs(trajectory)]
    assert len(put_away) == 3
    for one in put_away:
        assert one.kind == PlanKind.PUT and one.in_task
        environment.reset(one.index)
        room = room_of(simulator.view)
        operators = plan(tasks[one.task].task, room)
        assert [operator.name for operator in operators][-1] == "PutObject"
        assert operators[-1].item == room.start.held
        outcomes = [environment.step(act.call) for act in environment.expert_actions(one.index)]
        assert outcomes[-1].info.goal_reached and outcomes[-1].info.ended == "done"


def test_it_is_in_the_text_of_the_sequence(made, replayed):
    text = (replayed / "traj.txt").read_text()
    for number in put_downs(made.trajectory):
        assert f"Your main goal: {made.trajectory.sub_tasks[number].task_desc}" in text


def test_questions_ask_about_it(made, replayed):
    history = TrajectoryHistory(made.trajectory.traj_id, read_steps(replayed))
    ends = {made.trajectory.sub_trajs[n].low_pddl_idx[1] for n in put_downs(made.trajectory)}
    assert {move.after for move in history.moves} == ends
    asked = [*puts(history), *further_puts(history)]
    assert any(ends.intersection(candidate.clues) for candidate in asked)


def test_the_camera_is_not_raised_in_it(simulator):
    settings = TrajectorySettings(
        "bedroom-3", 0, 60, 6, task_types=(TaskType.EXAMINE,), look_around=True
    )
    trajectory = generate(settings, simulator).trajectory
    inserted = [n for n, low in enumerate(trajectory.plan.low_actions) if low.inserted == INSERTED]
    assert inserted
    for number in put_downs(trajectory):
        assert not set(inserted).intersection(range(*trajectory.sub_trajs[number].low_pddl_idx))
