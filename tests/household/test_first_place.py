"""The place that an agent looks at first, in a room by hand."""

import pytest

from infthor_eval.formats.twins import TwinPlace
from infthor_eval.household.first_place import FirstPlace, apart, first_place, is_looked_at
from infthor_eval.thor.view import AgentPose, Vector

OWN = TwinPlace("Drawer|1", 0.0, 3.0)
TWIN = TwinPlace("Desk|1", 3.0, 0.0)


def pose(x, z, rotation):
    return AgentPose(Vector(x, 0.9, z), rotation, 30.0)


@pytest.mark.parametrize(
    ("at", "looks"),
    [
        (pose(0.0, 1.5, 0.0), True),
        (pose(0.0, 1.4, 0.0), False),  # out of reach
        (pose(0.0, 2.0, 90.0), False),  # beside it
        (pose(0.0, 4.0, 180.0), True),
        (pose(0.5, 2.5, 0.0), True),  # 45 degrees aside
        (pose(0.6, 2.5, 0.0), False),
        (pose(0.0, 2.0, 360.0), True),
    ],
)
def test_a_place_is_looked_at_from_within_reach_and_in_front(at, looks):
    assert is_looked_at(at, OWN) == looks


def test_it_is_the_first_one_looked_at():
    there = pose(3.0, 1.0, 180.0)
    here = pose(0.0, 2.0, 0.0)
    nowhere = pose(1.0, 1.0, 90.0)
    places = OWN, TWIN
    assert first_place(places, [(nowhere, None)]) is None
    assert first_place(places, [(nowhere, None), (here, None), (there, None)]) == FirstPlace.OWN
    assert first_place(places, [(there, None), (here, None)]) == FirstPlace.TWIN


def test_a_container_that_is_opened_was_looked_at():
    nowhere = pose(1.0, 1.0, 90.0)
    places = OWN, TWIN
    assert first_place(places, [(nowhere, "Drawer|1")]) == FirstPlace.OWN
    assert first_place(places, [(nowhere, "Desk|1")]) == FirstPlace.TWIN
    assert first_place(places, [(nowhere, "Fridge|1")]) == FirstPlace.OTHER


def test_of_two_in_reach_it_is_the_nearer():
    near = TwinPlace("Shelf|1", 0.0, 2.5)
    assert first_place((OWN, near), [(pose(0.0, 1.8, 0.0), None)]) == FirstPlace.TWIN


def test_distances_are_along_the_floor():
    assert apart((TwinPlace("a", 0.0, 0.0), TwinPlace("b", 3.0, 4.0))) == 5.0
