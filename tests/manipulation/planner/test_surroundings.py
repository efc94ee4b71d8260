"""What an agent believes of what stands around it, and how that changes with what its arm meets."""

from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from infthor_eval.manipulation.planner.linkage import Parts
from infthor_eval.manipulation.planner.obstacles import clearances
from infthor_eval.manipulation.planner.surroundings import Belief, Surroundings
from infthor_eval.thor.view import Vector

from .test_places import lattice, thing, view_of
from .test_roadmap import linkage

__all__ = ["linkage"]

ACROSS, DEEP = np.arange(-0.175, 0.2, 0.05), np.arange(1.5, 1.8, 0.05)
MUG = thing("Mug|1", 0.0, 1.0, 0.9)
MESSAGE = "Collided with static sim object: '{}', could not reach target: '(0, 0, 0)'."


def cupboard(kind="Fridge", origin=0.0):
    """Its opening is at z = 1.45, and its open door reaches to z = 1."""
    box = thing(
        f"{kind}|1", 0.0, 0.9, 1.4, (0.44, 1.0, 0.8), pickupable=False, openable=True, is_open=True
    )
    return msgspec.structs.replace(box, position=Vector(origin, 0.9, 1.8))


def surroundings(linkage, item, *others, places=None):
    """With lattices of places by the ids of things."""
    places_of = {item.object_id: lattice(ACROSS, DEEP, (0.8,)), **(places or {})}

    def query(action, objectId, anywhere):
        assert (action, anywhere) == ("GetSpawnCoordinatesAboveReceptacle", True)
        return [
            dict(zip("xyz", point, strict=True)) for point in places_of.get(objectId, [])
        ] or None

    start = SimpleNamespace(object_id=MUG.object_id, receptacle_id=item.object_id)
    return Surroundings(
        SimpleNamespace(view=view_of(item, MUG, *others), start=start, query=query), linkage, 0.0
    )


def at(x, y, z):
    return Parts(np.array([[(x, y, z)]]), np.eye(3)[None, None], np.full((1, 1, 3), 0.01))


def is_solid(around, belief, *point):
    distances = clearances(at(*point), around.obstacles(belief))
    return distances.size > 0 and bool(distances.min() < 0)


# Before the opening, whose right is that of who looks into it.
LEFT, RIGHT = ((-0.2, 1.1, 1.3), (0.2, 1.1, 1.3))


@pytest.mark.parametrize(("kind", "origin", "door"), [
    ("Fridge", 0.0, RIGHT), ("Microwave", 0.0, LEFT), ("Cabinet", -0.2, LEFT),
    ("Cabinet", 0.2, RIGHT),
])  # fmt: skip
def test_a_door_hangs_where_the_origin_is_or_where_such_doors_do(linkage, kind, origin, door):
    around = surroundings(linkage, cupboard(kind, origin))
    solid = [point for point in (LEFT, RIGHT) if is_solid(around, Belief.RECEPTACLE, *point)]
    assert solid == [door]


def test_what_is_met_where_there_should_be_nothing_tells_of_the_other_side(linkage):
    around = surroundings(linkage, cupboard())
    assert around.add_collision(at(*LEFT), MESSAGE.format("Fridge|1"))
    assert is_solid(around, Belief.RECEPTACLE, *LEFT)
    assert not is_solid(around, Belief.RECEPTACLE, *RIGHT)
    assert not around.add_collision(at(*RIGHT), MESSAGE.format("Sofa|1"))
    assert is_solid(around, Belief.RECEPTACLE, *LEFT)


def test_the_less_is_believed_the_less_is_in_the_way(linkage):
    table = thing(
        "DiningTable|1", 0.8, 0.5, 0.9, (0.4, 1.0, 0.4), pickupable=False, receptacle=True
    )
    on_table = {
        table.object_id: lattice(np.arange(0.625, 1, 0.05), np.arange(0.725, 0.9, 0.05), (0.7,))
    }
    around = surroundings(linkage, cupboard(), table, places=on_table)
    over, below, inside = (0.8, 0.9, 0.8), (0.8, 0.3, 0.8), (0.0, 0.79, 1.6)
    beliefs = (Belief.WHOLE, Belief.FILLED, Belief.RECEPTACLE, Belief.NOTHING)
    assert [is_solid(around, belief, *over) for belief in beliefs] == [True, False, False, False]
    assert [is_solid(around, belief, *below) for belief in beliefs] == [True, True, False, False]
    assert [is_solid(around, belief, *inside) for belief in beliefs] == [True, True, True, False]
    assert is_solid(around, Belief.FILLED, 0.0, -0.02, 0.5)  # the floor


def test_what_was_met_fills_its_box(linkage):
    sofa = thing("Sofa|1", 0.8, 0.5, 0.9, (0.4, 1.0, 0.4), pickupable=False)
    around = surroundings(linkage, cupboard(), sofa)
    assert not is_solid(around, Belief.COLLIDED, 0.8, 0.5, 0.9)
    around.add_collision(at(0.6, 0.5, 0.9), MESSAGE.format("Sofa|1"))
    assert is_solid(around, Belief.COLLIDED, 0.8, 0.5, 0.9)
    assert not is_solid(around, Belief.RECEPTACLE, 0.8, 0.5, 0.9)


def test_what_the_arm_or_the_places_are_in_is_not_filled(linkage):
    around_arm = thing(
        "CounterTop|1", 0.0, 0.5, 0.8, (2.0, 1.1, 0.6), pickupable=False, receptacle=True
    )
    around_places = thing("Dresser|1", 0.0, 0.9, 1.7, (1.0, 1.0, 0.5), pickupable=False)
    around = surroundings(linkage, cupboard(), around_arm, around_places, places={
        "CounterTop|1": lattice(np.arange(-0.9, -0.5, 0.05), np.arange(0.6, 1.1, 0.05), (1.0,))
    })  # fmt: skip
    assert not is_solid(around, Belief.WHOLE, 0.3, 0.5, 0.8)
    assert is_solid(around, Belief.WHOLE, -0.7, 0.5, 0.8)
    assert not is_solid(around, Belief.WHOLE, 0.4, 1.0, 1.7)


def test_loose_things_take_places_but_are_in_nobodys_way(linkage):
    egg = thing("Egg|1", 0.0, 0.83, 1.6, (0.06, 0.06, 0.06))
    around = surroundings(linkage, cupboard(), egg)
    assert not is_solid(around, Belief.WHOLE, 0.0, 0.83, 1.6)
    assert any(box.low == pytest.approx((-0.03, 0.8, 1.57)) for box in around.others())
