from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import SAMPLED, TaskType

from .rooms import KITCHEN

ROOM = room_of(KITCHEN)


def test_every_type_with_and_without_slicing_is_in_the_pool():
    tasks = tasks_of(ROOM, {"Faucet"})
    assert {task.task_type for task in tasks} == set(SAMPLED)
    assert {task.task_type for task in tasks if task.sliced} == set(SAMPLED)
    assert len(tasks) == len(set(tasks))


def test_no_washing_without_a_faucet():
    assert not [task for task in tasks_of(ROOM) if task.task_type == TaskType.CLEAN]
