"""Places to put things down: how well something would lie there, what is in the way, openings."""

import numpy as np
import pytest

from infthor_eval.manipulation.geometry import corners_of
from infthor_eval.manipulation.planner.linkage import Parts
from infthor_eval.manipulation.planner.places import (
    Entry,
    Places,
    entry_of,
    firmness,
    occupancy,
    others_on,
    support,
)
from infthor_eval.thor.view import AgentPose, Box, SimulatorView, ThorObject, Vector

BOARD = 0.8  # metres above the floor


def lattice(xs, zs, heights=(BOARD,)):
    return np.array([(x, y, z) for y in heights for x in xs for z in zs])


def board(**changes):
    """A board of 0.4 m by 0.3 m around the origin."""
    points = lattice(
        np.arange(-0.175, 0.2, 0.05),
        np.arange(-0.125, 0.15, 0.05),
        changes.pop("heights", (BOARD,)),
    )
    return Places(**{"points": points, "spacing": 0.05, "top": BOARD, **changes})


def held(x, y, z, size=(0.1, 0.1, 0.1)):
    return Parts(np.array([[(x, y, z)]]), np.eye(3)[None, None], np.array([[size]]) / 2)


def thing(name, x, y, z, size=(0.1, 0.1, 0.1), **more):
    return ThorObject(
        name, name.split("|")[0], name, Vector(x, y, z),
        axis_aligned_bounding_box=Box(Vector(x, y, z), Vector(*size)),
        **{"pickupable": True, **more},
    )  # fmt: skip


def view_of(*things):
    agent = AgentPose(Vector(0.0, 0.9, -1.0), 0.0, 0.0)
    return SimulatorView(
        None, None, {t.object_id: t for t in things}, agent, (), True, "", "", None, "a"
    )


@pytest.mark.parametrize(("x", "y", "supported"), [
    (0.0, 0.9, 1.0), (0.0, 1.8, 1.0), (0.0, 0.86, 1.0),
    (0.0, 0.84, 0.0),  # its underside is below the board
    (0.24, 0.9, 0.0),  # its middle is beyond the edge
    (0.19, 0.9, 5 / 9),  # four of its eight corners are
])  # fmt: skip
def test_a_thing_is_supported_as_far_as_it_is_over_a_board(x, y, supported):
    assert support(held(x, y, 0.0), board())[0] == pytest.approx(supported)


def test_in_what_is_entered_a_thing_is_over_a_board_only_below_its_ceiling():
    shelves = board(heights=(0.4, 0.8), top=1.2, entered=True)
    assert [support(held(0.0, y, 0.0), shelves)[0] for y in (0.6, 1.0, 1.3)] == [1.0, 1.0, 0.0]
    bin_ = board(top=1.2)  # open above: let go over its rim a thing falls in
    assert support(held(0.0, 1.3, 0.0), bin_)[0] == 1.0


def test_the_middle_of_a_board_is_firmer_than_its_edge():
    middle, edge, corner = (
        firmness(held(x, 0.9, z), board())[0] for x, z in ((0, 0), (0.2, 0), (0.2, 0.15))
    )
    assert 1.0 == middle > edge > corner


def box(x, y, z, size=(0.1, 0.1, 0.1)):
    return corners_of(thing("Mug|1", x, y, z, size))


@pytest.mark.parametrize(("x", "share"), [(0.0, 1.0), (0.04, 1.0), (0.08, 0.5), (0.11, 0.0)])
def test_a_place_is_taken_most_where_the_middle_would_fall_on_another_thing(x, share):
    assert occupancy(held(x, 0.95, 0.0), board(), [box(0.0, 0.85, 0.0)])[0] == share


def test_what_is_above_the_hand_or_below_the_board_takes_no_place():
    assert occupancy(held(0, 0.9, 0), board(), [box(0.0, 1.2, 0.0), box(0.0, 0.7, 0.0)])[0] == 0
    assert occupancy(held(0, 0.9, 0), board(), [])[0] == 0


def test_what_covers_a_drawer_takes_its_places_but_not_the_sink_around_a_basin():
    over, around = box(0, 0.88, 0, (0.4, 0.04, 0.4)), box(0, 0.8, 0, (0.6, 0.3, 0.6))
    assert occupancy(held(0, 1.0, 0), board(), [over])[0] == 1
    assert occupancy(held(0, 1.0, 0), board(), [around])[0] == 0


def test_loose_things_count_wherever_they_belong_but_not_what_the_receptacle_is_in():
    tray = thing("Plate|1", 0, 0.8, 0, receptacle=True, parent_receptacles=["Box|1"])
    mug, lamp = thing("Mug|1", 0, 0.8, 0), thing("DeskLamp|1", 0, 0.8, 0, pickupable=False)
    view = view_of(tray, mug, lamp, thing("Box|1", 0, 0.8, 0), thing("Egg|1", 0, 1, 0))
    assert [other.object_id for other in others_on(view, tray, "Egg|1")] == ["Mug|1"]


def test_an_open_door_tells_where_an_opening_is_and_the_agent_where_there_is_no_door():
    places = board(top=1.2, entered=True)
    # The door widens its box towards +x.
    fridge = thing("Fridge|1", 0.3, 0.9, 0.0, openable=True, is_open=True)
    entry = entry_of(view_of(fridge), fridge, places)
    assert entry == Entry(0, 1, pytest.approx(0.225))
    assert entry.vector_out(0.2).tolist() == [0.2, 0.0, 0.0]
    shelf = thing("Shelf|1", 0.0, 0.9, 0.0)
    assert entry_of(view_of(shelf), shelf, places) == Entry(2, -1, pytest.approx(-0.175))
    table = thing("DiningTable|1", 0.0, 0.4, 0.0)
    assert entry_of(view_of(table), table, places) is None
