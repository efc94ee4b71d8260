"""What things in recorded floor plans are in or on, after their poses are set: as recorded."""

from collections.abc import Iterator, Sequence

import pytest

from infthor_sim.rearrange import NamedPose, set_poses
from infthor_sim.scenes.catalogue import Catalogue, FloorPlanData

from .conftest import need_data

# Some of each kind that was wrong: seats below desks, rims of sinks, things below furniture, that
# stand beside a pot or flaps, or on a shelf by their edges.
SOME = ["FloorPlan3", "FloorPlan7", "FloorPlan21", "FloorPlan204", "FloorPlan301", "FloorPlan409"]


def others_than_recorded(scenes: Sequence[str]) -> Iterator[tuple[str, set[str], str | None]]:
    """Yields each recorded thing: its id, its recorded parents' types, its parent's type now."""
    data, catalogue = FloorPlanData(need_data()), Catalogue(need_data())
    for scene in scenes:
        entries = data.objects(scene)
        types = {entry["objectId"]: entry["objectType"] for entry in entries}
        world = catalogue.load(scene)
        loose = [o for o in world.objects.values() if o.type.pickupable]
        set_poses(world, [NamedPose(o.name, o.position, o.rotation) for o in loose])
        now = {o.name: o for o in world.objects.values()}
        for entry in entries:
            if entry["pickupable"] and entry["parentReceptacles"]:
                parent = now[entry["name"]].parent
                recorded = {types[above] for above in entry["parentReceptacles"]}
                yield entry["objectId"], recorded, parent and world.objects[parent].object_type


def test_a_restore_keeps_what_things_are_on():
    found = list(others_than_recorded(SOME))
    assert len(found) > 80
    assert [row for row in found if row[2] not in row[1]] == []


@pytest.mark.slow
def test_a_restore_keeps_nearly_all_recorded_parents():
    found = list(others_than_recorded(FloorPlanData(need_data()).scenes()))
    assert len(found) > 1_700
    assert len([row for row in found if row[2] not in row[1]]) <= 9
