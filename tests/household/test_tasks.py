import json
import random
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import SubTask, TaskInfo
from infthor_eval.household.tasks import Task, TaskType, sub_task, task_of

SLICED = Task(TaskType.PLACE, "Apple", "Fridge", sliced=True)
TWO_KNIVES = Task(TaskType.PLACE_TWO, "Knife", "CounterTop")
EXAMINE = Task(TaskType.EXAMINE, "Mug", light="DeskLamp")
STACK = Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate")


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (SLICED, "put a sliced apple in the fridge"),
        (TWO_KNIVES, "put two knives on the counter top"),
        (replace(SLICED, task_type=TaskType.PLACE_TWO), "put two slices of apple in the fridge"),
        (EXAMINE, "look at a mug under the desk lamp"),
        (STACK, "put a plate with an apple on it on the counter top"),
    ],
)
def test_descriptions(task, words):
    assert sub_task(task, "kitchen-1").task_desc == words


GOAL_WORDS = json.loads((Path(__file__).parents[1] / "goldens" / "goal_words.json").read_text())


@pytest.mark.parametrize("row", GOAL_WORDS)
def test_published_words_are_those_of_the_published_generator(row):
    names = ("pickup", "receptacle", "movable", "light", "sliced")
    task = Task(TaskType(row["goal"]), *(row[name] for name in names))
    drawn = {sub_task(task, "kitchen-1", random.Random(seed)).task_desc for seed in range(40)}
    assert drawn == set(row["words"])
    published = sub_task(task, "kitchen-1", random.Random(0))
    natural = sub_task(task, "kitchen-1")
    assert (published.task_info, published.pddl_params) == (natural.task_info, natural.pddl_params)


def test_putting_away_has_one_description():
    for place in ("CounterTop", "Toilet"):
        put_away = Task(TaskType.PUT_AWAY, "Knife", place)
        for draw in (None, random.Random(0)):
            words = sub_task(put_away, "kitchen-1", draw).task_desc
            assert words == f"put the Knife on the {place}"


TASKS = [
    *(SLICED, TWO_KNIVES, EXAMINE, replace(STACK, sliced=True)),
    Task(TaskType.CLEAN, "Mug", "SideTable"),
    Task(TaskType.HEAT, "Potato", "Fridge", sliced=True),
    Task(TaskType.COOL, "Mug", "SideTable"),
    Task(TaskType.PUT_AWAY, "Knife", "Toilet"),
]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: str(task.task_type))
def test_a_task_comes_back_as_it_was(task):
    stored = msgspec.json.decode(msgspec.json.encode(sub_task(task, "kitchen-1")), type=SubTask)
    assert task_of(stored) == task


SIMPLE, NEEDS_BOTH = "pick_and_place_simple", "needs task_info's movable and receptacle"


def recorded(goal, pickup=None, movable=None, receptacle=None, **params):
    return SubTask(TaskInfo(goal, pickup, movable, receptacle), pddl_params=params)


def test_types_out_of_the_parameters_and_of_another_version():
    place = recorded(
        "pick_and_place_simple", object_target="Glassbottle", parent_target="Desk", mrecep_target=""
    )
    assert task_of(place) == Task(TaskType.PLACE, "Bottle", "Desk")
    slices = recorded("pick_and_place_simple", "AppleSliced", receptacle="Desk")
    assert task_of(slices).target == "AppleSliced"
    examine = recorded(
        "look_at_obj_in_light", "Book", None, "Desk", toggle_target="FloorLamp", object_sliced=None
    )
    assert task_of(examine) == Task(TaskType.EXAMINE, "Book", light="FloorLamp")


def test_what_is_put_away_is_the_movable_object_whatever_the_parameters_say():
    """They are those of the task before."""
    params = {"object_target": "Bread", "parent_target": "Fridge"}
    params |= {"mrecep_target": "", "object_sliced": True}
    away = recorded("put object", None, "Glassbottle", "Toilet", **params)
    assert task_of(away) == Task(TaskType.PUT_AWAY, "Bottle", "Toilet")


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (recorded(""), "a task has no goal; give one of pick_and_place_simple, "),
        (
            recorded("juggle", "Mug"),
            "a task's goal is 'juggle'; give one of pick_and_place_simple, ",
        ),
        (recorded(SIMPLE, receptacle="Desk"), "task_info's pickup or pddl_params' object_target"),
        (recorded(SIMPLE, "Mug", None, "Desk", object_sliced="no"), "object_sliced 'no'"),
        (
            recorded("pick_clean_then_place_in_recep", "Mug"),
            "has no task_info's receptacle or .*' parent_target",
        ),
        (
            recorded("pick_and_place_with_movable_recep", "Mug", "", "Desk"),
            "task_info's movable or .*' mrecep_target",
        ),
        (recorded("put object", receptacle="Toilet", mrecep_target="Mug"), NEEDS_BOTH),
        (recorded("put object", None, "Mug", parent_target="Toilet"), NEEDS_BOTH),
        (
            recorded("look_at_obj_in_light", "Mug", toggle_target=""),
            "no pddl_params' toggle_target",
        ),
        (recorded("look_at_obj_in_light", "Mug", toggle_target=3), "no pddl_params' toggle_target"),
    ],
)
def test_what_a_task_lacks_is_named(task, words):
    with pytest.raises(DataError, match=words):
        task_of(task)
