from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import SAMPLED, TaskType
from tests.thor.views import thing, view

from .rooms import KITCHEN, item

ROOM = room_of(KITCHEN)


def test_every_type_with_and_without_slicing_is_in_the_pool():
    tasks = tasks_of(ROOM, {"Faucet"})
    assert {task.task_type for task in tasks} == set(SAMPLED)
    assert {task.task_type for task in tasks if task.sliced} == set(SAMPLED)
    assert len(tasks) == len(set(tasks))


def test_no_washing_without_a_faucet():
    assert not [task for task in tasks_of(ROOM) if task.task_type == TaskType.CLEAN]


def test_two_things_go_where_the_published_table_of_goals_has_them():
    pairs = {"CoffeeMachine": "Mug", "HandTowelHolder": "HandTowel"}
    pairs |= {"ToiletPaperHanger": "ToiletPaper", "CounterTop": "Mug", "TowelHolder": "Towel"}
    places = [thing(f"{name}|+00.00|+00.00|+00.00", receptacle=True) for name in pairs]
    things = [
        item(f"{name}|+00.0{number}|+00.00|+00.00", places[0])
        for name in set(pairs.values())
        for number in (1, 2)
    ]
    tasks = tasks_of(room_of(view(*places, *things)))
    one, two = (
        {(task.receptacle, task.pickup) for task in tasks if task.task_type == kind}
        for kind in (TaskType.PLACE, TaskType.PLACE_TWO)
    )
    assert one >= set(pairs.items())
    barred = {"CoffeeMachine", "HandTowelHolder", "ToiletPaperHanger"}
    assert one - two == {(place, name) for place, name in one if place in barred}
