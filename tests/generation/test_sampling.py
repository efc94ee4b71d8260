import random
from collections import Counter

from infthor_eval.generation.sampling import TaskPool
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import TaskType
from tests.household.rooms import KITCHEN

ROOM = room_of(KITCHEN)


def drawn(number):
    """So many tasks one after the other, each used."""
    pool = TaskPool(TaskType, random.Random(0))
    chosen = []
    for _ in range(number):
        task = next(pool.sample(ROOM, {"Faucet"}))
        pool.note_use(task)
        chosen.append(task)
    return chosen


def test_use_keeps_the_choice_diverse():
    chosen = drawn(28)
    types = Counter(task.task_type for task in chosen)
    assert set(types) == set(TaskType) and max(types.values()) <= 8
    assert len(set(chosen)) > 20


def test_the_seed_decides():
    def draw(seed):
        return [str(task) for task in TaskPool(TaskType, random.Random(seed)).sample(ROOM)]

    assert draw(1) == draw(1) != draw(2)


def test_the_choice_stays_diverse_however_long_the_trajectory():
    late = Counter(drawn(3000)[-300:])
    assert {task.task_type for task in late} == set(TaskType)
    assert max(late.values()) <= 30
    assert len(late) > 60


def test_a_task_that_failed_comes_later_but_is_not_given_up():
    failing = next(TaskPool(TaskType, random.Random(0)).sample(ROOM))

    def mean_rank(failures):
        ranks = []
        for seed in range(60):
            pool = TaskPool(TaskType, random.Random(seed))
            for _ in range(failures):
                pool.note_failure(failing)
            ranks.append(list(pool.sample(ROOM)).index(failing))
        return sum(ranks) / len(ranks)

    assert mean_rank(0) < mean_rank(1) < mean_rank(3) == mean_rank(1000) < len(list(tasks_of(ROOM))) - 1
