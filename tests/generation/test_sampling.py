import random
from collections import Counter

from infthor_eval.generation.sampling import TaskPool, tasks_of
from infthor_eval.generation.symbolic import room_of
from infthor_eval.generation.tasks import Task, TaskType, sub_task

from .rooms import KITCHEN

ROOM = room_of(KITCHEN)


def test_every_type_with_and_without_slicing_is_in_the_pool():
    tasks = tasks_of(ROOM, {"Faucet"})
    assert {task.kind for task in tasks} == set(TaskType)
    assert {task.kind for task in tasks if task.sliced} == set(TaskType)
    assert len(tasks) == len(set(tasks))


def test_no_washing_without_a_faucet():
    assert not [task for task in tasks_of(ROOM) if task.kind == TaskType.CLEAN]


def test_use_keeps_the_choice_diverse():
    pool = TaskPool(TaskType, random.Random(0))
    chosen = []
    for _ in range(28):
        task = next(pool.sample(ROOM, {"Faucet"}))
        pool.used(task)
        chosen.append(task)
    kinds = Counter(task.kind for task in chosen)
    assert set(kinds) == set(TaskType) and max(kinds.values()) <= 8
    assert len(set(chosen)) > 20


def test_the_seed_decides():
    def draw(seed):
        return [str(task) for task in TaskPool(TaskType, random.Random(seed)).sample(ROOM)]

    assert draw(1) == draw(1) != draw(2)


def test_descriptions():
    def words(task):
        return sub_task(task, "kitchen-1").task_desc

    assert words(Task(TaskType.PLACE, "Apple", "Fridge", sliced=True)) == "put a sliced apple in the fridge"
    assert words(Task(TaskType.PLACE_TWO, "Knife", "CounterTop")) == "put two knives on the counter top"
    assert words(Task(TaskType.PLACE_TWO, "Apple", "Fridge", sliced=True)) == "put two slices of apple in the fridge"
    assert words(Task(TaskType.EXAMINE, "Mug", light="DeskLamp")) == "look at a mug under the desk lamp"
    stack = Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate")
    assert words(stack) == "put a plate with an apple on it on the counter top"


def test_a_task_that_failed_a_thousand_times_does_not_stop_the_others():
    pool = TaskPool(TaskType, random.Random(0))
    first = next(pool.sample(ROOM))
    for _ in range(1000):
        pool.failed(first)
    order = list(pool.sample(ROOM))
    assert order[-1] == first
    assert len(order) > 1
