"""Things are put where there is room, by what is drawn: by points in solids, and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_sim.object_types import OBJECT_TYPES, allowed_in
from infthor_sim.objects import default_object
from infthor_sim.physics.free_places import find_place
from infthor_sim.physics.solids import Wall, opening_space, part_boxes
from infthor_sim.scenes.catalogue import Catalogue

from ..helpers.benchmarks import load_benchmark
from .harness import Bench

ROOMS = ("kitchen", "living-room", "bedroom", "bathroom")
LOOSE = sorted(name for name, declared in OBJECT_TYPES.items() if declared.pickupable)


COUNTING = load_benchmark("interpenetrations")


@pytest.mark.parametrize("kind", ROOMS)
@pytest.mark.parametrize("seed", [3, 4])
def test_nothing_goes_through_anything_at_rest_or_when_something_opens(kind, seed):
    faults = COUNTING.faults(Catalogue().load(f"{kind}-{seed}"))
    assert faults == {"at rest": set(), "wall": set(), "opened": set()}


def test_the_count_sees_what_it_is_to_see():
    world = Catalogue().load("living-room-3")
    sofa = next(o for o in world.objects.values() if o.object_type == "Sofa")
    box = next(o for o in world.objects.values() if o.object_type == "Box")
    back = sofa.center - 0.4 * sofa.matrix[:, 2] * sofa.box_size[2]
    box.place_bottom(np.array([back[0], sofa.surface_height(), back[2]]))
    world.mark_changed(box)
    pairs = COUNTING.faults(world)["at rest"]
    assert {sofa.object_id, box.object_id} in [{*pair} for pair in pairs]
    book = next(o for o in world.objects.values() if o.object_type == "Book")
    book.place_bottom(np.array([world.rooms[0].x_max, 0.5, 0.0]))
    world.mark_changed(book)
    assert (book.object_id, "Wall") in COUNTING.faults(world)["wall"]


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(ROOMS), st.integers(0, 40), st.sampled_from(LOOSE), st.integers(0, 2**32 - 1)
)
def test_what_is_put_somewhere_goes_through_nothing(kind, seed, object_type, draw):
    world = Catalogue().load(f"{kind}-{seed}")
    random = np.random.default_rng(draw)
    fixed = [o for o in world.objects.values() if not o.type.pickupable]
    homes = [o for o in fixed if allowed_in(object_type, o.object_type)]
    home = homes[draw % len(homes)] if homes else None
    item = default_object(object_type, np.array([0.0, 50.0, 0.0]))
    place = find_place(world, item, home, random=random) if home else None
    if place is None:
        return
    placed = place.duplicate(f"{object_type}|new")
    world.add(placed)
    world.attach(placed, home)
    if home.type.encloses:
        COUNTING.open_one(world, home, 1.0)
    assert not list(COUNTING.Room(world).pairs({placed.object_id}))


def test_no_thing_stands_where_a_door_swings():
    for seed in range(6):
        world = Catalogue().load(f"kitchen-{seed}")
        for item in world.objects.values():
            space = opening_space(item)
            if space is None:
                continue
            for other in world.objects.values():
                low, high = other.bounds()
                inside = np.minimum(high, space[1]) - np.maximum(low, space[0])
                hidden = (
                    other.object_type in {"Floor", "CounterTop", "StoveKnob"} or other.type.built_in
                )
                assert hidden or inside.min() < 0.004, f"{other.object_id} before {item.object_id}"


def test_by_hand_an_armchair_has_its_seat_between_arms_and_back():
    chair = default_object("ArmChair", np.zeros(3))
    parts = part_boxes(chair)
    level = chair.surface_height()
    above = [box for box in parts if box[1][1] > level + 0.05]
    back = [box for box in above if box[1][2] < 0]  # its front is towards +z
    arms = [box for box in above if box[1][2] > 0]
    assert len(back) == 1 and len(arms) == 2
    assert sorted(np.sign((low + high)[0]) for low, high in arms) == [-1, 1]


def test_by_hand_a_thing_fits_in_a_round_vessel_by_its_corners():
    wall = Wall(
        np.array([0.0, 0.5, 0.0]), np.array([0.2, 0.5, 0.2]), np.eye(3), bottom=0.5, top=1.0
    )
    # 0.099 m from the middle
    corners = np.array([[0.07, 0.07], [0.07, -0.07], [-0.07, 0.07], [-0.07, -0.07]])
    middle = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # the radius is 0.1 m below, 0.2 m above
    assert wall.holds(middle, corners).tolist() == [True, True]
    assert wall.holds(middle + np.array([0.02, 0.0, 0.0]), corners).tolist() == [False, True]


def test_a_thing_that_is_too_high_is_not_put_into_a_drawer():
    bench = Bench.at("kitchen-1", size=60)
    drawer = bench.first("Drawer")
    lettuce = next(o for o in bench.metadata["objects"] if o["objectType"] == "Lettuce")["objectId"]
    bench.force("OpenObject", drawer)
    bench.force("PickupObject", lettuce)
    assert "No valid positions" in bench.refused("PutObject", drawer, forceAction=True)
