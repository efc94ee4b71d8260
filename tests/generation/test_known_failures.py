from msgspec.structs import replace

from infthor_eval.generation.known_failures import KnownFailures
from infthor_eval.thor.view import Vector
from tests.household.rooms import APPLE, COUNTER, FRIDGE, KITCHEN, KNIFE, MUG, TABLE
from tests.thor.views import view

OTHERS = [item for item in KITCHEN.objects.values() if item.object_id != MUG.object_id]


def items(room):
    return {item for item, _ in room.start.where}


def test_an_object_out_of_reach_is_no_item_until_it_moves():
    setbacks = KnownFailures()
    setbacks.note(KITCHEN, MUG.object_id, None)
    assert setbacks and MUG.object_id not in items(setbacks.room(KITCHEN))
    moved = view(*OTHERS, replace(MUG, position=Vector(3.0, 0.9, 0.0)))
    assert MUG.object_id in items(setbacks.room(moved))
    assert not setbacks


def test_a_full_receptacle_refuses_until_it_loses_something():
    setbacks = KnownFailures()
    setbacks.note(KITCHEN, MUG.object_id, FRIDGE.object_id)
    pair = (MUG.object_id, FRIDGE.object_id)
    assert setbacks.room(KITCHEN).refused == {pair}
    fuller = view(*OTHERS, replace(MUG, parent_receptacles=[FRIDGE.object_id]))
    assert setbacks.room(fuller).refused == {pair}
    without_apple = [item for item in KITCHEN.objects.values() if item.object_id != APPLE.object_id]
    emptier = view(*without_apple, replace(APPLE, parent_receptacles=[TABLE.object_id]))
    assert not setbacks.room(emptier).refused


def test_setbacks_are_believed_for_some_tasks_only():
    setbacks = KnownFailures()
    setbacks.note(KITCHEN, KNIFE.object_id, None)
    setbacks.note(KITCHEN, MUG.object_id, COUNTER.object_id)
    believed = 0
    while setbacks.room(KITCHEN) and setbacks:
        setbacks.task_done()
        believed += 1
    assert 1 < believed < 30


def test_forgetting():
    setbacks = KnownFailures()
    setbacks.note(KITCHEN, KNIFE.object_id, None)
    setbacks.forget()
    assert not setbacks and KNIFE.object_id in items(setbacks.room(KITCHEN))


def test_an_object_that_is_gone_is_not_remembered():
    setbacks = KnownFailures()
    setbacks.note(KITCHEN, "Egg|+00.00|+00.00|+00.00", None)
    assert not setbacks
