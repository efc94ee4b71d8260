"""The plans of our trajectories, the published ones, and ALFRED's."""

import gzip
from itertools import chain, islice
from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import Trajectory, TrajectorySource, iter_trajectories
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.plans.plan import PlanKind, plans_of, tasks_of

from ..helpers.trajectories import read_trajectory

SHARED = Path(__file__).parents[2] / "../shared/data"


def ours(name="kitchen-1-seed7"):
    return read_trajectory(name)


def published(name):
    path = SHARED / "published_goldens" / name
    if not path.exists():
        pytest.skip("published trajectories are not at ../shared/data")
    return next(iter_trajectories(path))


def alfred(number):
    path = SHARED / "alfred/valid_seen.jsonl.gz"
    if not path.exists():
        pytest.skip("ALFRED's trajectories are not at ../shared/data")
    with gzip.open(path) as lines:
        return [TrajectorySource(path, 1, raw).read() for raw in islice(lines, number)]


def test_our_plans():
    trajectory = ours()
    plans = plans_of(trajectory, Words.NATURAL)
    assert [task.task for task in tasks_of(trajectory)] == [
        Task(TaskType.CLEAN, "Apple", "Fridge"),
        Task(TaskType.COOL, "Bowl", "SinkBasin"),
        Task(TaskType.HEAT, "Tomato", "DiningTable", sliced=True),
    ]
    assert [plan.task for plan in plans] == [0] * 6 + [1] * 6 + [2] * 12
    ways = ["go to the cabinet", "go to the sinkbasin", "go to the fridge"]
    deeds = ["pick up the apple", "wash the apple", "put the apple in the fridge"]
    assert [plan.text for plan in plans[:6]] == list(chain(*zip(ways, deeds, strict=True)))
    assert [plan.low for plan in plans[:2]] == [(0, 11), (11, 14)]
    assert plans[0].location == "loc|6|1|0|30"
    assert plans[5].kind == PlanKind.PUT and plans[5].receptacle_id == "Fridge|-02.12|+00.00|+01.54"
    check(trajectory)


def test_what_stands_between_two_tasks_belongs_to_the_one_before():
    plans = plans_of(ours("bedroom-2-seed7"), Words.NATURAL)
    assert [plan.task for plan in plans[2:7]] == [0, 0, 0, 0, 1]  # tasks 0 to 4, and 6 to 14


def test_published_plans():
    check(published("floorplan28_train.json"))
    trajectory = published("floorplan28_test.json")
    check(trajectory)
    tasks, plans = tasks_of(trajectory), plans_of(trajectory, Words.NATURAL)
    assert tasks[-1].task == Task(TaskType.COOL, "Apple", "Microwave")
    assert {plan.task for plan in plans if plan.is_final} == {len(tasks) - 1}


def test_alfred_plans():
    for trajectory in alfred(60):
        check(trajectory)
        plans, tasks = plans_of(trajectory, Words.NATURAL), tasks_of(trajectory)
        assert len(tasks) == 1 and tasks[0].task.task_type == trajectory.task_type
        assert tasks[0].text == trajectory.turk_annotations["anns"][0]["task_desc"]
        # The sub-goal without an action is none of them.
        assert not any(plan.is_final for plan in plans)
        assert len(plans) == len(trajectory.plan.high_pddl) - (
            "End" in repr(trajectory.plan.high_pddl[-1])
        )


def check(trajectory):
    """Whether the plans cover the actions, one after the other."""
    plans = plans_of(trajectory, Words.NATURAL)
    assert [plan.index for plan in plans] == list(range(len(plans)))
    assert [plan.low[0] for plan in plans] == [0, *(plan.low[1] for plan in plans[:-1])]
    assert plans[-1].low[1] == len(trajectory.plan.low_actions)
    assert all(plan.location for plan in plans if plan.kind == PlanKind.GOTO)


def changed(trajectory, change):
    document = msgspec.to_builtins(trajectory)
    change(document)
    return msgspec.convert(document, Trajectory)


FAULTS = [
    (lambda it: it["sub_tasks"][1]["task_info"].update(goal=""), "task 1: a task has no goal"),
    (lambda it: it["sub_tasks"].pop(), "3 parts for 2 tasks"),
    (
        lambda it: it["sub_trajs"][0].update(high_pddl_idx=[0, 99]),
        "task 0 has sub-goals 0 to 99 of 24",
    ),
    (
        lambda it: it["plan"]["low_actions"][3].update(high_idx=7),
        "action 4 belongs to sub-goal 0, out of order",
    ),
    (lambda it: it["plan"]["low_actions"][-1].update(high_idx=77), "there is no sub-goal 77"),
    (
        lambda it: it["plan"]["high_pddl"][2]["discrete_action"].update(action="Fly"),
        "sub-goal 2 is 'Fly'; there are Goto",
    ),
]


@pytest.mark.parametrize(("change", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_what_is_wrong_is_named(change, words):
    with pytest.raises(DataError, match=f"^trajectory kitchen-1-seed7.*{words}"):
        plans_of(changed(ours(), change), Words.NATURAL)
