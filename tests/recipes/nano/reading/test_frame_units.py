"""What the decoder reads first: frames as a tower without mistakes would tell them."""

from types import SimpleNamespace

import numpy as np
import pytest

from recipes.nano.reading.frame_units import label_units
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seen_objects import SeenFrame, SeenObject, read_seen_frames

UNITS = Units(("Apple", "Fridge", "Knife", "Plate"))
LOOSE = np.array([True, False, True, True])


def told(*objects, size=(300, 300)):
    """What is on, as (token, role, type)."""
    frame = SimpleNamespace(size=size, digest="x")
    found = label_units([SeenFrame(frame, objects)], UNITS, LOOSE, 3, 0)
    on = found.values[0] > 0
    return {(token, Role(role), UNITS.types[index]) for token, role, index in on.nonzero().tolist()}


def test_a_thing_is_in_the_token_of_its_box_with_its_place():
    assert told(SeenObject("Apple", (110, 10, 140, 40), True, "Fridge")) == {
        (1, Role.SHOWN, "Apple"),
        (1, Role.AROUND, "Fridge"),
    }


def test_frames_of_another_size_have_the_same_tokens():
    found = told(SeenObject("Apple", (220, 10, 280, 80), True), size=(600, 600))
    assert found == {(1, Role.SHOWN, "Apple")}


@pytest.mark.parametrize(
    ("box", "tokens"),
    [
        ((0, 0, 299, 299), range(9)),
        ((0, 100, 299, 199), (3, 4, 5)),
        ((80, 110, 119, 140), (3, 4)),  # half of it in each
        ((60, 110, 109, 140), (3,)),  # a fifth of it in the second one
    ],
)
def test_a_box_over_several_tokens(box, tokens):
    assert {token for token, _, _ in told(SeenObject("Fridge", box, True))} == {*tokens}


def test_what_is_held_has_no_place_and_what_is_open_is_said_to_be():
    held = SeenObject("Knife", (110, 210, 190, 290), True, "Plate", is_held=True)
    door = SeenObject("Fridge", (0, 0, 90, 90), True, "Floor", is_open=True)
    assert told(held, door) == {
        (7, Role.SHOWN, "Knife"),
        (7, Role.HELD, "Knife"),
        (0, Role.SHOWN, "Fridge"),
        (0, Role.OPEN, "Fridge"),
    }


def test_what_is_too_small_or_has_no_units_is_left_out():
    assert not told(
        SeenObject("Apple", (10, 10, 16, 16), True), SeenObject("Sofa", (0, 0, 99, 99), True)
    )


def test_all_frames_of_a_set_are_known_by_their_digests(small_set):
    seen = read_seen_frames([small_set])
    names = {one.type for _, objects in seen for one in objects}
    units = Units(names)
    found = label_units(seen, units, np.ones(len(units.types), bool), 3, 0)
    assert found.values.shape == (len(seen), 9, len(Role), len(units.types))
    for frame, objects in seen:
        values = found.values[found.index[frame.digest]]
        for one in objects:
            if one.is_held:
                assert (values[:, Role.HELD, units.index(one.type)] > 0).any()
