"""Where an object was last, by the log."""

import pytest

from infthor_eval.formats.step_log import ObjectLog
from infthor_eval.plans.actors.baselines import last_place, way_by_memory
from tests.plans.building import DRAWER, FRIDGE, TABLE, kitchen

LOGS = [
    ObjectLog(recep_objs={"Fridge": ["Mug"], "SideTable": ["Cup"]}),
    ObjectLog(recep_objs={"Dresser": ["Cup", "Mug"], "Drawer": ["Mug"], "Floor": ["Mug"]}),
    ObjectLog(recep_objs={"SideTable": ["Cup"]}),
]


class Room:
    """An environment in which the way to a thing is its id."""

    def actions_to(self, object_id):
        return [f"to {object_id}"]


@pytest.mark.parametrize(
    ("name", "n_frames", "place"),
    [
        ("Mug", 3, "Drawer"),  # the innermost of what it was in
        ("Mug", 1, "Fridge"),
        ("Cup", 3, "SideTable"),
        ("Spoon", 3, None),
        ("Mug", 0, None),
    ],
)
def test_the_last_sight_counts(name, n_frames, place):
    assert last_place(name, LOGS[:n_frames]) == place


@pytest.mark.parametrize(
    ("plan", "opened", "way"),
    [
        ("pick up the Mug", (), [f"to {DRAWER}", "OpenObject Drawer"]),
        ("pick up the Mug", (DRAWER,), [f"to {DRAWER}"]),
        ("pick up the cup", (), [f"to {TABLE}"]),
        ("put the Mug in the Fridge", (), [f"to {FRIDGE}"]),
        ("pick up the Spoon", (), []),
        ("go to the Mug", (), []),
        ("wash the Mug", (), []),
    ],
)
def test_it_goes_there_and_opens_what_is_closed(plan, opened, way):
    assert way_by_memory(plan, Room(), kitchen(opened=opened), LOGS) == way
