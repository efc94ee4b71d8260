from infthor_eval.thor.grounding import Grounding, id_position

from .views import thing, view

LEFT = thing("Drawer|+00.00|+00.50|+00.00", receptacle=True)
RIGHT = thing("Drawer|+01.00|+00.50|+00.00", receptacle=True)
ONE = thing("Apple|+00.00|+00.90|+00.00", pickupable=True)
OTHER = thing("Apple|+00.30|+00.90|+00.00", pickupable=True)


def test_the_nearest_of_the_type_is_meant():
    world = view(LEFT, RIGHT, ONE)
    grounding = Grounding(world)
    assert grounding.ground("Drawer|+00.90|+00.55|+00.10", world) == RIGHT.object_id
    assert round(grounding.distances["Drawer|+00.90|+00.55|+00.10"], 3) == 0.15


def test_an_exact_id_is_itself():
    world = view(LEFT, RIGHT)
    assert Grounding(world).ground(LEFT.object_id, world) == LEFT.object_id


def test_no_such_type():
    world = view(LEFT)
    assert Grounding(world).ground("Fridge|+00.00|+00.00|+00.00", world) is None


def test_a_type_that_was_renamed():
    bottle = thing("Bottle|+00.10|+00.90|+00.00", pickupable=True)
    world = view(bottle)
    assert Grounding(world).ground("Glassbottle|+00.05|+00.90|+00.00", world) == bottle.object_id


def test_two_recorded_things_are_two_things():
    world = view(ONE, OTHER)
    grounding = Grounding(world)
    grounded = [grounding.ground(f"Apple|+00.{n}|+00.90|+00.00", world) for n in ("05", "06", "05")]
    assert grounded == [ONE.object_id, OTHER.object_id, ONE.object_id]


def test_furniture_may_be_merged():
    world = view(LEFT)
    grounding = Grounding(world)
    ids = [grounding.ground(f"Drawer|+00.{n}|+00.50|+00.00", world) for n in ("10", "20")]
    assert ids == [LEFT.object_id, LEFT.object_id]


def test_the_place_at_the_start_counts_not_the_present_one():
    before = view(ONE, OTHER)
    grounding = Grounding(before)
    moved = thing(ONE.object_id, pickupable=True, position=OTHER.position)
    after = view(moved, OTHER)
    assert grounding.ground("Apple|+00.02|+00.90|+00.00", after) == ONE.object_id


def test_positions_in_ids():
    assert id_position("Mug|-01.25|+00.90|+02.00") == (-1.25, 0.9, 2.0)
    assert id_position("Mug") is None
    assert id_position("surface|3|4") is None
