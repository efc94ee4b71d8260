"""The innermost receptacle where the simulator names all of them, as Unity does."""

import pytest
from msgspec.structs import replace

from infthor_eval.formats.step_log import ObjectState
from infthor_eval.household.containment import direct_parent, logged_parent
from infthor_eval.thor.view import Box, Vector

from .rooms import APPLE, COUNTER, FRIDGE, KITCHEN, MUG

WORLD = {
    "Floor|1": ObjectState("Floor"),
    "CounterTop|1": ObjectState("CounterTop"),
    "Shelf|1": ObjectState("Shelf"),
    "Sink|1": ObjectState("Sink"),
    "Sink|1|SinkBasin": ObjectState("SinkBasin"),
    "Plate|1": ObjectState("Plate", parents=("CounterTop|1",)),
}


@pytest.mark.parametrize(
    ("parents", "parent"),
    [
        (("Plate|1", "CounterTop|1"), "Plate|1"),
        (("CounterTop|1", "Plate|1"), "Plate|1"),
        (("Sink|1", "Sink|1|SinkBasin"), "Sink|1|SinkBasin"),
        (("CounterTop|1", "Shelf|1"), None),
        (("Floor|1",), None),
        (("Box|gone",), None),
        ((), None),
    ],
)
def test_of_a_logged_object_it_is_told_where_it_is_clear(parents, parent):
    assert logged_parent(ObjectState("Apple", parents=parents), WORLD) == parent
    assert logged_parent(ObjectState("Apple", parents=parents, held=True), WORLD) is None


def test_of_an_object_in_a_view_it_is_what_can_be_carried_then_the_smallest():
    def of(*parents, objects=KITCHEN.objects):
        ids = [item.object_id for item in parents]
        return direct_parent(replace(APPLE, parent_receptacles=ids), objects)

    assert of(COUNTER, MUG) == MUG.object_id
    assert of(FRIDGE, COUNTER) == COUNTER.object_id  # the fridge here has no box
    assert of() is None
    small = replace(FRIDGE, axis_aligned_bounding_box=Box(Vector(), Vector(0.1, 0.1, 0.1)))
    objects = {**KITCHEN.objects, small.object_id: small}
    assert of(COUNTER, small, objects=objects) == small.object_id
