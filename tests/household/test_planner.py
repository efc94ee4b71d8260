from collections import deque

import pytest

from infthor_eval.household.goals import is_achieved, lower_bound
from infthor_eval.household.planner import _Problem, plan
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import Task, TaskType

from .rooms import APPLE, COUNTER, KITCHEN, MUG

ROOM = room_of(KITCHEN)
EXTRA = {"Faucet"}


def names(task):
    return [step.name.removesuffix("Object").removesuffix("Location") for step in plan(task, ROOM)]


@pytest.mark.parametrize(
    ("task", "steps"),
    [
        (Task(TaskType.PLACE, "Mug", "DiningTable"), "Goto Pickup Goto Put"),
        (Task(TaskType.CLEAN, "Mug", "DiningTable"), "Goto Pickup Goto Clean Goto Put"),
        (Task(TaskType.HEAT, "Apple", "CounterTop"), "Goto Pickup Goto Heat Goto Put"),
        (Task(TaskType.COOL, "Mug", "CounterTop"), "Goto Pickup Goto Cool Goto Put"),
        (Task(TaskType.EXAMINE, "Mug", light="DeskLamp"), "Goto Pickup Goto Toggle"),
        (Task(TaskType.PLACE_TWO, "Apple", "CounterTop"), " ".join(["Goto Pickup Goto Put"] * 2)),
        (
            Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate"),
            "Goto Pickup Put Pickup Goto Put",
        ),
        (Task(TaskType.PUT_AWAY, "Mug", "DiningTable"), "Goto Pickup Goto Put"),
        (
            Task(TaskType.PLACE, "Apple", "CounterTop", sliced=True),
            "Goto Pickup Goto Put Pickup Slice",
        ),
    ],
)
def test_plans_of_every_type(task, steps):
    action_names = names(task)
    assert sorted(action_names) == sorted(steps.split())
    assert action_names[-1] == steps.split()[-1]


def test_nothing_to_do_and_nothing_to_be_done():
    assert plan(Task(TaskType.PLACE, "Mug", "CounterTop"), ROOM) == []
    assert plan(Task(TaskType.PLACE, "Vase", "CounterTop"), ROOM) is None


def test_contents_move_with_what_carries_them():
    steps = plan(Task(TaskType.STACK, "Spoon", "DiningTable", movable="Mug"), ROOM)
    assert [step.item for step in steps if step.name == "PickupObject"] == [MUG.object_id]


PUT_AWAY = [Task(TaskType.PUT_AWAY, item, "DiningTable") for item in ("Mug", "Apple")]


@pytest.mark.parametrize("task", [*tasks_of(ROOM, EXTRA), *PUT_AWAY], ids=str)
def test_no_shorter_plan_exists(task):
    """Against plain breadth-first search, and the bound never exceeds what is left."""
    actions = plan(task, ROOM)
    assert actions is not None
    assert len(actions) == shortest(task, len(actions))


def shortest(task, limit):
    problem = _Problem(task, ROOM)
    depth = {problem.start: 0}
    queue = deque([problem.start])
    while queue:
        state = queue.popleft()
        if is_achieved(task, ROOM, state):
            assert lower_bound(task, ROOM, state) + depth[state] <= limit
            return depth[state]
        for _, following in problem.successors(state):
            if following not in depth:
                depth[following] = depth[state] + 1
                queue.append(following)
    return None


def test_the_room_is_read_from_the_metadata():
    where = dict(ROOM.start.where)
    assert where[MUG.object_id] == COUNTER.object_id
    slice_id = f"{APPLE.object_id}#1"
    assert (ROOM.types[slice_id], where[slice_id]) == ("AppleSliced", "")
    assert ROOM.place_of("Spoon|+00.20|+00.95|+00.00", where) == COUNTER.object_id
