import json
import random
from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import SubTask, TaskInfo
from infthor_eval.household.tasks import Task, TaskType, sub_task, task_of


def test_descriptions():
    def words(task):
        return sub_task(task, "kitchen-1").task_desc

    assert (
        words(Task(TaskType.PLACE, "Apple", "Fridge", sliced=True))
        == "put a sliced apple in the fridge"
    )
    assert (
        words(Task(TaskType.PLACE_TWO, "Knife", "CounterTop"))
        == "put two knives on the counter top"
    )
    assert (
        words(Task(TaskType.PLACE_TWO, "Apple", "Fridge", sliced=True))
        == "put two slices of apple in the fridge"
    )
    assert (
        words(Task(TaskType.EXAMINE, "Mug", light="DeskLamp"))
        == "look at a mug under the desk lamp"
    )
    stack = Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate")
    assert words(stack) == "put a plate with an apple on it on the counter top"


GOAL_WORDS = json.loads((Path(__file__).parents[1] / "goldens" / "goal_words.json").read_text())


@pytest.mark.parametrize("row", GOAL_WORDS)
def test_published_words_are_those_of_the_published_generator(row):
    task = Task(
        TaskType(row["goal"]),
        row["pickup"],
        row["receptacle"],
        row["movable"],
        row["light"],
        row["sliced"],
    )
    drawn = {sub_task(task, "kitchen-1", random.Random(seed)).task_desc for seed in range(40)}
    assert drawn == set(row["words"])
    published = sub_task(task, "kitchen-1", random.Random(0))
    natural = sub_task(task, "kitchen-1")
    assert (published.task_info, published.pddl_params) == (natural.task_info, natural.pddl_params)


def test_putting_away_has_one_description():
    put_away = Task(TaskType.PUT_AWAY, "Knife", "CounterTop")
    for draw in (None, random.Random(0)):
        words = sub_task(put_away, "kitchen-1", draw).task_desc
        assert words == "put the Knife on the CounterTop"


TASKS = [
    Task(TaskType.PLACE, "Apple", "Fridge", sliced=True),
    Task(TaskType.PLACE_TWO, "Knife", "CounterTop"),
    Task(TaskType.EXAMINE, "Mug", light="DeskLamp"),
    Task(TaskType.CLEAN, "Mug", "SideTable"),
    Task(TaskType.HEAT, "Potato", "Fridge", sliced=True),
    Task(TaskType.COOL, "Mug", "SideTable"),
    Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate", sliced=True),
    Task(TaskType.PUT_AWAY, "Knife", "Toilet"),
]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: str(task.task_type))
def test_a_task_comes_back_as_it_was(task):
    stored = msgspec.json.decode(msgspec.json.encode(sub_task(task, "kitchen-1")), type=SubTask)
    assert task_of(stored) == task


def recorded(goal, pickup=None, movable=None, receptacle=None, **params):
    return SubTask(TaskInfo(goal, pickup, movable, receptacle), pddl_params=params)


def test_types_out_of_the_parameters_and_of_another_version():
    place = recorded(
        "pick_and_place_simple", object_target="Glassbottle", parent_target="Desk", mrecep_target=""
    )
    assert task_of(place) == Task(TaskType.PLACE, "Bottle", "Desk")
    assert (
        task_of(recorded("pick_and_place_simple", "AppleSliced", receptacle="Desk")).target
        == "AppleSliced"
    )
    examine = recorded(
        "look_at_obj_in_light", "Book", None, "Desk", toggle_target="FloorLamp", object_sliced=None
    )
    assert task_of(examine) == Task(TaskType.EXAMINE, "Book", light="FloorLamp")


def test_what_is_put_away_is_the_movable_object_whatever_the_parameters_say():
    """They are those of the task before."""
    params = {
        "object_target": "Bread",
        "parent_target": "Fridge",
        "mrecep_target": "",
        "object_sliced": True,
    }
    away = recorded("put object", None, "Glassbottle", "Toilet", **params)
    assert task_of(away) == Task(TaskType.PUT_AWAY, "Bottle", "Toilet")
    assert (
        sub_task(Task(TaskType.PUT_AWAY, "Knife", "Toilet"), "kitchen-1").task_desc
        == "put the Knife on the Toilet"
    )


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (recorded(""), "a task has no goal; give one of pick_and_place_simple, "),
        (
            recorded("juggle", "Mug"),
            "a task's goal is 'juggle'; give one of pick_and_place_simple, ",
        ),
        (
            recorded("pick_and_place_simple", receptacle="Desk"),
            "has no task_info's pickup or pddl_params' object_target",
        ),
        (
            recorded("pick_clean_then_place_in_recep", "Mug"),
            "has no task_info's receptacle or .*' parent_target",
        ),
        (
            recorded("pick_and_place_with_movable_recep", "Mug", "", "Desk"),
            "task_info's movable or .*' mrecep_target",
        ),
        (
            recorded("put object", receptacle="Toilet", mrecep_target="Mug"),
            "needs task_info's movable and receptacle",
        ),
        (
            recorded("put object", None, "Mug", parent_target="Toilet"),
            "needs task_info's movable and receptacle",
        ),
        (
            recorded("look_at_obj_in_light", "Mug", toggle_target=""),
            "has no pddl_params' toggle_target",
        ),
        (
            recorded("look_at_obj_in_light", "Mug", toggle_target=3),
            "has no pddl_params' toggle_target",
        ),
        (
            recorded("pick_and_place_simple", "Mug", None, "Desk", object_sliced="no"),
            "object_sliced 'no'",
        ),
    ],
)
def test_what_a_task_lacks_is_named(task, words):
    with pytest.raises(DataError, match=words):
        task_of(task)
