"""Goals on symbolic states and views written by hand: planner and PDDL play no part."""

from dataclasses import replace

import pytest

from infthor_eval.household.goals import goal_holds, is_achieved
from infthor_eval.household.symbolic import ABSENT, FLOOR, State, SymbolicRoom
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
    kitchen,
)

TYPES = {
    "table-1": "SideTable",
    "table-2": "SideTable",
    "desk": "Desk",
    "lamp": "DeskLamp",
    "other-lamp": "FloorLamp",
    "mug-1": "Mug",
    "mug-2": "Mug",
    "plate": "Plate",
    "apple": "Apple",
    "slice": "AppleSliced",
}
ITEMS = ("mug-1", "mug-2", "plate", "apple", "slice")


def state(at=None, held=None, clean=(), hot=(), cold=(), lit=(), **where):
    places = {item: where.get(item.replace("-", "_"), FLOOR) for item in ITEMS}
    if held is not None:
        places[held] = ABSENT
    pairs = tuple(sorted(places.items()))
    return State(at, held, pairs, frozenset(clean), frozenset(hot), frozenset(cold), frozenset(lit))


def holds(task, now):
    places = frozenset({"table-1", "table-2", "desk", "lamp", "other-lamp"})
    receptacles = frozenset({"table-1", "table-2", "desk", "plate"})
    return is_achieved(task, SymbolicRoom(TYPES, places, receptacles, now), now)


PLACE = Task(TaskType.PLACE, "Mug", "SideTable")
SLICE = Task(TaskType.PLACE, "Apple", "SideTable", sliced=True)
TWO = Task(TaskType.PLACE_TWO, "Mug", "SideTable")
EXAMINE = Task(TaskType.EXAMINE, "Mug", light="DeskLamp")
CLEAN = Task(TaskType.CLEAN, "Mug", "SideTable")
HEAT = Task(TaskType.HEAT, "Mug", "SideTable")
COOL = Task(TaskType.COOL, "Mug", "SideTable")
STACK = Task(TaskType.STACK, "Apple", "SideTable", movable="Plate")
AWAY = Task(TaskType.PUT_AWAY, "Apple", "SideTable")


@pytest.mark.parametrize(
    ("task", "now", "expected"),
    [
        (PLACE, state(mug_1="table-2"), True),
        (PLACE, state(mug_1="desk"), False),
        (PLACE, state(mug_1="plate", plate="table-1"), False),
        (PLACE, state(held="mug-1", at="table-1"), False),
        (PLACE, state(apple="table-1"), False),
        (SLICE, state(slice="table-1"), True),
        (SLICE, state(apple="table-1"), False),
        (TWO, state(mug_1="table-1", mug_2="table-1"), True),
        (TWO, state(mug_1="table-1", mug_2="table-2"), False),
        (TWO, state(mug_1="table-1", plate="table-1"), False),
        (TWO, state(mug_1="desk", mug_2="desk"), False),
        (EXAMINE, state(held="mug-1", at="lamp", lit=["lamp"]), True),
        (EXAMINE, state(held="mug-1", at="lamp"), False),
        (EXAMINE, state(held="mug-1", at="desk", lit=["lamp"]), False),
        (EXAMINE, state(held="apple", at="lamp", lit=["lamp"]), False),
        (EXAMINE, state(held="mug-1", at="other-lamp", lit=["other-lamp"]), False),
        (EXAMINE, state(at="lamp", lit=["lamp"], mug_1="desk"), False),
        (CLEAN, state(mug_1="table-1", clean=["mug-1"]), True),
        (CLEAN, state(mug_1="table-1", mug_2="desk", clean=["mug-2"]), False),
        (CLEAN, state(mug_1="desk", clean=["mug-1"]), False),
        (HEAT, state(mug_1="table-1", hot=["mug-1"]), True),
        (HEAT, state(mug_1="table-1", cold=["mug-1"], clean=["mug-1"]), False),
        (HEAT, state(held="mug-1", at="table-1", hot=["mug-1"]), False),
        (COOL, state(mug_1="table-1", cold=["mug-1"]), True),
        (COOL, state(mug_1="table-1", hot=["mug-1"]), False),
        (COOL, state(mug_1="desk", cold=["mug-1"]), False),
        (STACK, state(apple="plate", plate="table-2"), True),
        (STACK, state(apple="plate", plate="desk"), False),
        (STACK, state(apple="table-2", plate="table-2"), False),
        (STACK, state(apple="plate", held="plate", at="table-2"), False),
        (STACK, state(mug_1="plate", plate="table-2"), False),
        (AWAY, state(apple="table-1"), True),
        (AWAY, state(slice="table-1"), True),
        (AWAY, state(slice="table-1", held="mug-1"), False),
        (AWAY, state(held="apple"), False),
        (AWAY, state(apple="desk"), False),
    ],
    ids=str,
)
def test_a_goal_holds_or_does_not(task, now, expected):
    assert holds(task, now) is expected


def test_a_treatment_is_of_the_object_that_is_there():
    there = state(mug_1="table-1", mug_2="table-1", clean=["mug-2"])
    assert holds(CLEAN, there)
    assert not holds(CLEAN, replace(there, clean=frozenset({"plate"})))


ALL = Treatments(*[frozenset({MUG, SLICE_2})] * 3)
HOT_SLICE = Task(TaskType.HEAT, "Apple", "SideTable", sliced=True)


def on_table(*things):
    """The things on one table, everything else in the fridge."""
    everything = (MUG, CUP, PLATE, APPLE, SLICE_1, SLICE_2)
    return kitchen({key: OTHER_TABLE if key in things else FRIDGE for key in everything})


# What the counts of conditions do not tell (test_goal_conditions.py).
@pytest.mark.parametrize(
    ("task", "view", "treatments", "expected"),
    [
        (EXAMINE, kitchen(held=CUP, on=[LAMP]), Treatments(), False),
        (EXAMINE, kitchen(held=MUG, on=[LAMP], hidden=[LAMP]), None, True),
        (CLEAN, on_table(MUG), Treatments(clean=frozenset({MUG})), True),
        (CLEAN, on_table(MUG), Treatments(clean=frozenset({CUP})), False),
        (CLEAN, on_table(CUP), ALL, False),
        (HEAT, on_table(MUG), Treatments(cold=frozenset({MUG})), False),
        (HOT_SLICE, on_table(SLICE_2), ALL, True),
        (HOT_SLICE, on_table(SLICE_1), ALL, False),
        (COOL, on_table(MUG), ALL, True),
        (COOL, on_table(MUG), Treatments(hot=frozenset({MUG})), False),
        (COOL, on_table(MUG), None, True),
        (STACK, kitchen({PLATE: OTHER_TABLE, APPLE: OTHER_TABLE}), Treatments(), False),
    ],
)
def test_a_goal_holds_in_a_view_or_does_not(task, view, treatments, expected):
    assert goal_holds(task, view, treatments) is expected
