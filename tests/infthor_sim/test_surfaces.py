"""Things stand on what is drawn: measured by points below each thing, and by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_sim.geometry import aabb_overlap
from infthor_sim.object_types import OBJECT_TYPES, allowed_in
from infthor_sim.objects import SimObject, default_object
from infthor_sim.physics.free_places import find_place
from infthor_sim.physics.receptacles import surfaces
from infthor_sim.physics.solids import as_open
from infthor_sim.render.primitives import AXES, BOTTOM, CENTER, FORM, HALF, TOP, Form, rows
from infthor_sim.render.shapes import shape
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.world import World

HANGERS = {"HandTowelHolder", "TowelHolder", "ToiletPaperHanger"}
LOOSE = sorted(name for name, declared in OBJECT_TYPES.items() if declared.pickupable)
STANDS = sorted(
    name for name, declared in OBJECT_TYPES.items()
    if declared.receptacle and any(allowed_in(loose, name) for loose in LOOSE)
)  # fmt: skip
NEAR = 0.012  # metres between a thing and what it stands on
WALL = 0.012  # metres of the wall of a drawn vessel, which has none
SLIDE = 0.5  # metres by which drawings may be out of their boxes, as open drawers are
RISE = 0.03  # metres above its underside at which what it stands on is looked for


def in_solid(row: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which of some points (n, 3) lie in one drawn primitive; of a vessel, in its wall or floor."""
    half = row[HALF : HALF + 3]
    unit = (points - row[CENTER : CENTER + 3]) @ row[AXES : AXES + 9].reshape(3, 3).T / half
    if row[FORM] == Form.BOX:
        return (np.abs(unit) <= 1).all(axis=1)
    if row[FORM] == Form.ELLIPSOID:
        return np.linalg.norm(unit, axis=1) <= 1
    level, away, wide = unit[:, 1], np.hypot(unit[:, 0], unit[:, 2]), min(half[0], half[2])
    bottom = (level + 1) * half[1] < WALL
    share = (np.clip(level, -1, 1) + 1) / 2
    radius = (
        np.sqrt(1 - (1 - share) ** 2)
        if row[FORM] == Form.BOWL
        else row[BOTTOM] + (row[TOP] - row[BOTTOM]) * share
    )
    within = (np.abs(level) <= 1) & (away <= radius)
    if row[FORM] == Form.CYLINDER:
        return within
    return within & (bottom | ((radius - away) * wide < WALL))


def parts_below(world: World, placed: SimObject, deep: float) -> np.ndarray:
    """Drawn primitives of others that reach into the space below a thing, `deep` metres."""
    low, high = placed.bounds()
    around = np.array([SLIDE, deep, SLIDE])
    near = []
    for other in world.objects.values():
        if other is placed or not aabb_overlap(*other.bounds(), low - around, high + around):
            continue
        near.append(rows(shape(other), other.position, other.matrix, 0))
    return np.concatenate(near)


def gap_below(world: World, placed: SimObject) -> float:
    """Metres from a thing's underside to the first drawn solid under one of 25 points."""
    low, high = placed.bounds()
    shares = np.linspace(0.05, 0.95, 5)
    depths = np.arange(-RISE, 0.3, 0.002)
    parts = parts_below(world, placed, float(depths[-1]))
    gaps = []
    for x in low[0] + shares * (high - low)[0]:
        for z in low[2] + shares * (high - low)[2]:
            line = np.stack(
                [np.full(len(depths), x), low[1] - depths, np.full(len(depths), z)], axis=1
            )
            hit = np.any([in_solid(row, line) for row in parts], axis=0)
            gaps.append(depths[hit.argmax()] if hit.any() else np.inf)
    return max(0.0, float(min(gaps)))


def hangs_on(rail: SimObject, hung: SimObject) -> bool:
    """Whether a round bar of a rail goes through the upper half of a thing."""
    low, high = hung.bounds()
    for row in rows(shape(rail), rail.position, rail.matrix, 0):
        at, axis = row[CENTER : CENTER + 3], row[AXES + 3 : AXES + 6]  # a cylinder's own axis is y
        if row[FORM] == Form.CYLINDER and abs(axis[0]) > 0.99:
            inside = ((low + high) / 2 * [0, 1, 0] + low * [1, 0, 1] <= at) & (at <= high)
            return bool(inside[1:].all() and abs(at[0] - (low + high)[0] / 2) < row[HALF + 1])
    return False


def lone(object_type: str, grown: float) -> tuple[World, SimObject]:
    """An open receptacle alone in a room, above its floor."""
    world = Catalogue().load("kitchen-1")
    for item in list(world.objects.values()):
        world.remove(item)
    usual = default_object(object_type, np.zeros(3)).box_size * (
        1.0 if object_type in HANGERS else grown
    )
    middle = (
        (world.rooms[0].x_min + world.rooms[0].x_max) / 2,
        (world.rooms[0].z_min + world.rooms[0].z_max) / 2,
    )
    receptacle = default_object(object_type, np.array([middle[0], 1.0, middle[1]]), size=usual)
    receptacle.hinge = -1
    receptacle = as_open(receptacle, 1.0) if receptacle.type.openable else receptacle
    world.add(receptacle)
    return world, receptacle


@pytest.mark.parametrize("object_type", STANDS)
@given(st.data(), st.floats(0.8, 1.4), st.integers(0, 2**32 - 1))
@settings(max_examples=6, deadline=None)
def test_what_is_put_somewhere_stands_on_what_is_drawn(object_type, data, grown, draw):
    world, receptacle = lone(object_type, grown)
    loose = data.draw(st.sampled_from([name for name in LOOSE if allowed_in(name, object_type)]))
    place = find_place(
        world,
        default_object(loose, np.array([0.0, 50.0, 0.0])),
        receptacle,
        random=np.random.default_rng(draw),
    )
    if place is None:
        return
    placed = place.duplicate(f"{loose}|new")
    world.add(placed)
    if object_type in HANGERS:
        assert hangs_on(receptacle, placed)
    # a fridge's shelves are drawn as frames in front, as clear glass is seen through
    elif object_type != "Fridge":
        assert gap_below(world, placed) < NEAR


@pytest.mark.parametrize("kind", ["bathroom", "kitchen"])
def test_all_that_a_room_begins_with_stands_on_what_is_drawn(kind):
    for seed in range(4):
        world = Catalogue().load(f"{kind}-{seed}")
        for item in list(world.objects.values()):
            home = world.objects.get(item.parent or "")
            if (
                not item.type.pickupable
                or home is None
                or home.type.encloses
                or home.object_type in HANGERS
            ):
                continue
            if not any(outer.type.encloses for outer in world.ancestors(item)):
                assert gap_below(world, item) < NEAR, f"{item.object_id} on {home.object_id}"


def test_by_hand_things_on_a_toilet_stand_on_its_tank():
    toilet = default_object("Toilet", np.zeros(3), size=np.array([0.45, 0.85, 0.7]))
    (tank,) = surfaces(toilet)
    assert tank.center == pytest.approx([0.0, 0.85, -0.252])  # its front is towards +z
    assert tank.half == pytest.approx((0.21375, 0.098))


def test_by_hand_a_pan_holds_things_beside_its_handle_and_a_carton_between_its_flaps():
    pan = default_object("Pan", np.zeros(3), size=np.array([0.28, 0.05, 0.40]))
    (inside,) = surfaces(pan)
    # its round part is 0.28 m wide, at the end of the box
    assert inside.center[[0, 2]] == pytest.approx([0.0, -0.06])
    assert inside.half == pytest.approx((0.102, 0.102))
    carton = default_object("Box", np.zeros(3), size=np.array([0.5, 0.3, 0.5]))
    assert carton.state.openness == 1.0
    (inside,) = surfaces(carton)
    # 0.82 of its box is what is left when it is closed
    assert inside.half == pytest.approx((0.195, 0.195))
