import random
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.generation.sampling import TaskPool
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import Task, TaskType
from tests.household.rooms import KITCHEN

TASKS = tasks_of(room_of(KITCHEN), {"Faucet"})


def draws(seed, tasks=TASKS):
    pool = TaskPool(random.Random(seed))
    return list(iter(lambda: pool.draw(tasks), None))


def test_each_task_is_drawn_once():
    assert set(draws(0)) == set(TASKS)
    assert len(draws(0)) == len(TASKS)


def test_the_seed_decides():
    assert draws(1) == draws(1) != draws(2)


def test_an_exhausted_pool_begins_again_unless_nothing_was_drawn():
    pool = TaskPool(random.Random(0))
    assert not pool.begin_again(TASKS) and pool.restarts == 0
    first = [pool.draw(TASKS[:3]) for _ in range(4)]
    assert first[3] is None and set(first[:3]) == set(TASKS[:3])
    assert pool.begin_again(TASKS[:3]) and pool.restarts == 1
    assert pool.draw(TASKS[:3]) in TASKS[:3]


def test_a_small_variable_leads_more_often_than_a_large_one():
    # Weights are shares of their variable's sum: of 2 goals one soon leads by far, of 20 objects none does.
    tasks = [Task(kind, f"Item{number:02d}", "Table") for kind in ("a", "b") for number in range(20)]
    first = Counter(TaskPool(random.Random(seed)).draw(tasks).task_type for seed in range(400))
    assert 150 < first["a"] < 250


def test_every_task_type_comes_early():
    firsts = Counter(TaskPool(random.Random(seed)).draw(TASKS).task_type for seed in range(300))
    assert set(firsts) == {task.task_type for task in TASKS} <= set(TaskType)


@given(st.integers(0, 10_000), st.sets(st.integers(0, len(TASKS) - 1), min_size=1))
def test_what_is_drawn_is_among_the_candidates(seed, chosen):
    candidates = [TASKS[index] for index in sorted(chosen)]
    assert TaskPool(random.Random(seed)).draw(candidates) in candidates
