from msgspec.structs import replace

from infthor_eval.generation.known_failures import KnownFailures
from infthor_eval.thor.view import Vector
from tests.household.rooms import APPLE, COUNTER, FRIDGE, KITCHEN, KNIFE, MUG, TABLE
from tests.thor.views import view

OTHERS = [item for item in KITCHEN.objects.values() if item.object_id != MUG.object_id]


def items(room):
    return {item for item, _ in room.start.where}


def test_an_object_out_of_reach_is_no_item_until_it_moves():
    failures = KnownFailures()
    failures.note(KITCHEN, MUG.object_id, None)
    assert failures and MUG.object_id not in items(failures.room(KITCHEN))
    moved = view(*OTHERS, replace(MUG, position=Vector(3.0, 0.9, 0.0)))
    assert MUG.object_id in items(failures.room(moved))
    assert not failures


def test_a_full_receptacle_refuses_until_it_loses_something():
    failures = KnownFailures()
    failures.note(KITCHEN, MUG.object_id, FRIDGE.object_id)
    pair = (MUG.object_id, FRIDGE.object_id)
    assert failures.room(KITCHEN).refused == {pair}
    fuller = view(*OTHERS, replace(MUG, parent_receptacles=[FRIDGE.object_id]))
    assert failures.room(fuller).refused == {pair}
    without_apple = [item for item in KITCHEN.objects.values() if item.object_id != APPLE.object_id]
    emptier = view(*without_apple, replace(APPLE, parent_receptacles=[TABLE.object_id]))
    assert not failures.room(emptier).refused


def test_failures_are_forgotten_after_some_tasks():
    failures = KnownFailures()
    failures.note(KITCHEN, KNIFE.object_id, None)
    failures.note(KITCHEN, MUG.object_id, COUNTER.object_id)
    n_tasks = 0
    while failures.room(KITCHEN) and failures:
        failures.task_done()
        n_tasks += 1
    assert 1 < n_tasks < 30


def test_forgetting():
    failures = KnownFailures()
    failures.note(KITCHEN, KNIFE.object_id, None)
    failures.forget()
    assert not failures and KNIFE.object_id in items(failures.room(KITCHEN))


def test_an_object_that_is_gone_is_not_remembered():
    failures = KnownFailures()
    failures.note(KITCHEN, "Egg|+00.00|+00.00|+00.00", None)
    assert not failures
