"""ALFRED's goal conditions, counted by hand in views made by hand."""

import pytest

from infthor_eval.household.goals import goal_conditions, goal_holds
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from tests.plans.building import (
    APPLE,
    CUP,
    FRIDGE,
    LAMP,
    MUG,
    OTHER_TABLE,
    PLATE,
    SLICE_1,
    SLICE_2,
    TABLE,
    kitchen,
)

PLACE = Task(TaskType.PLACE, "Mug", "Fridge")
SLICE = Task(TaskType.PLACE, "Apple", "Fridge", sliced=True)
TWO = Task(TaskType.PLACE_TWO, "Apple", "SideTable", sliced=True)
EXAMINE = Task(TaskType.EXAMINE, "Mug", light="DeskLamp")
HEAT = Task(TaskType.HEAT, "Mug", "Fridge")
STACK = Task(TaskType.STACK, "Apple", "Fridge", movable="Plate")
AWAY = Task(TaskType.PUT_AWAY, "Apple", "Fridge")
HOT_MUG, HOT_CUP = (Treatments(hot=frozenset({key})) for key in (MUG, CUP))


@pytest.mark.parametrize(
    ("task", "view", "treatments", "met", "total"),
    [
        (PLACE, kitchen(), Treatments(), 0, 1),
        (PLACE, kitchen({MUG: FRIDGE}), Treatments(), 1, 1),
        (PLACE, kitchen({CUP: FRIDGE}), Treatments(), 0, 1),
        (AWAY, kitchen({SLICE_1: FRIDGE}), Treatments(), 1, 1),
        (AWAY, kitchen({SLICE_1: FRIDGE}, held=MUG), Treatments(), 0, 1),
        (SLICE, kitchen(without=[SLICE_1, SLICE_2]), Treatments(), 0, 2),
        (SLICE, kitchen(), Treatments(), 1, 2),
        (SLICE, kitchen({SLICE_1: FRIDGE}), Treatments(), 2, 2),
        (SLICE, kitchen({APPLE: FRIDGE}), Treatments(), 1, 2),
        (TWO, kitchen({SLICE_1: OTHER_TABLE}), Treatments(), 3, 4),
        (TWO, kitchen({SLICE_1: OTHER_TABLE}, without=[SLICE_2]), Treatments(), 2, 4),
        (TWO, kitchen(), Treatments(), 4, 4),
        (EXAMINE, kitchen(), Treatments(), 0, 2),
        (EXAMINE, kitchen(held=MUG), Treatments(), 1, 2),
        (EXAMINE, kitchen(on=[LAMP]), Treatments(), 1, 2),
        (EXAMINE, kitchen(held=MUG, on=[LAMP], hidden=[LAMP]), Treatments(), 1, 2),
        (EXAMINE, kitchen(held=MUG, on=[LAMP]), Treatments(), 2, 2),
        (HEAT, kitchen({MUG: FRIDGE}), Treatments(), 1, 3),
        (HEAT, kitchen(), HOT_MUG, 1, 3),
        (HEAT, kitchen({MUG: FRIDGE}), HOT_CUP, 1, 3),
        (HEAT, kitchen({MUG: FRIDGE}), HOT_MUG, 3, 3),
        (STACK, kitchen(), Treatments(), 0, 3),
        (STACK, kitchen({APPLE: PLATE}), Treatments(), 1, 3),
        (STACK, kitchen({PLATE: FRIDGE}), Treatments(), 1, 3),
        (STACK, kitchen({APPLE: FRIDGE, PLATE: TABLE}), Treatments(), 0, 3),
        (STACK, kitchen({APPLE: PLATE, PLATE: FRIDGE}), Treatments(), 3, 3),
    ],
)
def test_each_condition_counts_and_all_of_them_are_the_goal(task, view, treatments, met, total):
    assert goal_conditions(task, view, treatments) == (met, total)
    assert goal_holds(task, view, treatments) == (met == total)
