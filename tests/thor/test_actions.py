import pytest

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.thor.actions import (
    ActionText,
    UngroundedError,
    applicable_actions,
    applicable_calls,
    ground,
    parse_action,
    text_of,
    text_of_call,
)

from .views import thing, view

MUG = thing("Mug|+01.00|+00.90|+00.00", pickupable=True, distance=1.0)
NEAR_MUG = thing("Mug|+00.50|+00.90|+00.00", pickupable=True, distance=0.5)
HIDDEN_MUG = thing("Mug|+00.10|+00.90|+00.00", pickupable=True, distance=0.1, visible=False)
FRIDGE = thing(
    "Fridge|+02.00|+00.00|+00.00", receptacle=True, openable=True, is_open=True, distance=1.2
)
APPLE = thing("Apple|+00.00|+00.90|+01.00", pickupable=True, sliceable=True, distance=1.0)


@pytest.mark.parametrize("text", ["MoveAhead", "PickupObject Mug", "PutObject Mug Fridge", "NoOp"])
def test_text_is_read_and_written_alike(text):
    assert str(parse_action(f"  {text} ")) == text


@pytest.mark.parametrize(
    "text", ["", "Fly", "PickupObject", "MoveAhead Mug", "PutObject Mug", "pickupobject Mug"]
)
def test_other_text_is_refused(text):
    with pytest.raises(UngroundedError):
        parse_action(text)


def test_the_nearest_visible_object_is_meant():
    call = ground(ActionText("PickupObject", ("Mug",)), view(MUG, NEAR_MUG, HIDDEN_MUG))
    assert call == {"action": "PickupObject", "objectId": NEAR_MUG.object_id}


@pytest.mark.parametrize(
    ("text", "world", "words"),
    [
        ("PickupObject Cup", view(MUG), "none in this scene"),
        ("PickupObject Mug", view(HIDDEN_MUG), "none in sight"),
        ("OpenObject Fridge", view(FRIDGE), "none of those in sight allows it"),
        ("PutObject Mug Fridge", view(MUG, FRIDGE), "no Mug in the hand"),
    ],
)
def test_what_does_not_apply_is_told(text, world, words):
    with pytest.raises(UngroundedError, match=words):
        ground(parse_action(text), world)


def test_put_names_the_receptacle():
    holding = view(MUG, FRIDGE, inventory=[MUG.object_id])
    call = ground(parse_action("PutObject Mug Fridge"), holding)
    assert call == {"action": "PutObject", "objectId": FRIDGE.object_id}


def test_moves_need_no_object():
    assert ground(parse_action("LookDown"), view()) == {"action": "LookDown", "degrees": 30.0}
    assert ground(parse_action("NoOp"), view()) == {"action": "Pass"}


@pytest.mark.parametrize(
    ("object_id", "object_type"),
    [
        ("Mug|+01.00|+00.90|-00.50", "Mug"),
        ("Sink|+01.00|+00.90|-00.50|SinkBasin", "SinkBasin"),
        ("Apple|+01.00|+00.90|-00.50|AppleSliced_3", "AppleSliced"),
    ],
)
def test_types_of_ids(object_id, object_type):
    assert object_type_of(object_id) == object_type
    assert text_of("PickupObject", object_id).names == (object_type,)


def test_what_is_possible_counts_every_object_in_view():
    drawers = [
        thing(f"Drawer|+0{number}.00|+00.50|+00.00", openable=True, receptacle=True)
        for number in range(3)
    ]
    mug = thing("Mug|+00.20|+00.90|+00.00", pickupable=True)
    hidden = thing("Cup|+00.30|+00.90|+00.00", pickupable=True, visible=False)
    calls = applicable_calls(view(*drawers, mug, hidden), degrees=15.0)
    assert [call["action"] for call in calls].count("OpenObject") == 3
    assert {"action": "LookUp", "degrees": 15.0} in calls
    picked = {call["objectId"] for call in calls if call["action"] == "PickupObject"}
    assert picked == {mug.object_id}
    assert not [call for call in calls if call["action"] == "PutObject"]
    texts = [str(text) for text in applicable_actions(view(*drawers, mug, hidden))]
    assert texts.count("OpenObject Drawer") == 1
    held = view(*drawers, mug, inventory=[mug.object_id])
    puts = [call for call in applicable_calls(held) if call["action"] == "PutObject"]
    assert [str(text_of_call(call, held)) for call in puts] == ["PutObject Mug Drawer"] * 3
