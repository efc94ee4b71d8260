"""Goals on symbolic states and views written by hand: planner and PDDL play no part."""

from dataclasses import replace

import pytest

from infthor_eval.household.goals import goal_holds, is_achieved
from infthor_eval.household.symbolic import ABSENT, FLOOR, State, SymbolicRoom
from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from tests.plans import building
from tests.plans.building import kitchen

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
    return is_achieved(
        task,
        SymbolicRoom(TYPES, places, frozenset({"table-1", "table-2", "desk", "plate"}), now),
        now,
    )


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


THERE, HERE = building.OTHER_TABLE, building.FRIDGE
ALL = Treatments(*[frozenset({building.MUG, building.SLICE_2})] * 3)
STACKED = {building.APPLE: building.PLATE, building.PLATE: THERE}


def all_in(*things):
    """The things on one table, everything else in the fridge."""
    everything = (
        building.MUG,
        building.CUP,
        building.PLATE,
        building.APPLE,
        building.SLICE_1,
        building.SLICE_2,
    )
    return kitchen({key: THERE if key in things else HERE for key in everything})


TWO_SLICES = Task(TaskType.PLACE_TWO, "Apple", "SideTable", sliced=True)
HOT_SLICE = Task(TaskType.HEAT, "Apple", "SideTable", sliced=True)


@pytest.mark.parametrize(
    ("task", "view", "treatments", "expected"),
    [
        (PLACE, all_in(building.MUG), Treatments(), True),
        (PLACE, all_in(building.CUP), Treatments(), False),
        (PLACE, all_in(), Treatments(), False),
        (SLICE, all_in(building.SLICE_2), Treatments(), True),
        (SLICE, all_in(building.APPLE), Treatments(), False),
        (TWO_SLICES, all_in(building.SLICE_1, building.SLICE_2), Treatments(), True),
        (TWO_SLICES, kitchen({building.SLICE_1: THERE}), Treatments(), False),
        (EXAMINE, kitchen(held=building.MUG, on=[building.LAMP]), Treatments(), True),
        (EXAMINE, kitchen(held=building.MUG), Treatments(), False),
        (EXAMINE, kitchen(held=building.CUP, on=[building.LAMP]), Treatments(), False),
        (
            EXAMINE,
            kitchen(held=building.MUG, on=[building.LAMP], hidden=[building.LAMP]),
            Treatments(),
            False,
        ),
        (
            EXAMINE,
            kitchen(held=building.MUG, on=[building.LAMP], hidden=[building.LAMP]),
            None,
            True,
        ),
        (EXAMINE, kitchen(on=[building.LAMP]), Treatments(), False),
        (CLEAN, all_in(building.MUG), Treatments(clean=frozenset({building.MUG})), True),
        (CLEAN, all_in(building.MUG), Treatments(clean=frozenset({building.CUP})), False),
        (CLEAN, all_in(building.CUP), ALL, False),
        (HEAT, all_in(building.MUG), ALL, True),
        (HEAT, all_in(building.MUG), Treatments(cold=frozenset({building.MUG})), False),
        (HOT_SLICE, all_in(building.SLICE_2), ALL, True),
        (HOT_SLICE, all_in(building.SLICE_1), ALL, False),
        (COOL, all_in(building.MUG), ALL, True),
        (COOL, all_in(building.MUG), Treatments(hot=frozenset({building.MUG})), False),
        (COOL, all_in(building.MUG), None, True),
        (STACK, kitchen(STACKED), Treatments(), True),
        (STACK, kitchen({**STACKED, building.PLATE: HERE}), Treatments(), False),
        (STACK, kitchen({building.PLATE: THERE, building.APPLE: THERE}), Treatments(), False),
    ],
)
def test_a_goal_holds_in_a_view_or_does_not(task, view, treatments, expected):
    assert goal_holds(task, view, treatments) is expected
