import pytest

from infthor_eval.formats.trajectory import ApiAction, DiscreteAction, LowAction
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate

from .views import thing, view

MUG = thing("Mug|+01.00|+00.90|+00.00", pickupable=True)
FRIDGE = thing("Fridge|+02.00|+00.00|+00.00", receptacle=True)


def call(api, name=None):
    world = view(MUG, FRIDGE)
    low = LowAction(api, discrete_action=None if name is None else DiscreteAction(name))
    return translate(low, Grounding(world), world)


@pytest.mark.parametrize(
    ("api", "name", "degrees"),
    [
        (ApiAction("LookDown"), "LookDown_15", 15.0),
        (ApiAction("LookDown"), None, 30.0),
        (ApiAction("LookUp", degrees=10.0), "LookUp_15", 10.0),
        (ApiAction("RotateLeft"), "RotateLeft_90", 90.0),
        (ApiAction("RotateRight"), "RotateRight", 90.0),
    ],
)
def test_turns(api, name, degrees):
    assert call(api, name) == {"action": api.action, "degrees": degrees}


def test_moves_without_the_old_force():
    api = ApiAction("MoveAhead", move_magnitude=0.25, force_action=True)
    assert call(api) == {"action": "MoveAhead", "moveMagnitude": 0.25}


def test_put_names_the_receptacle_alone():
    api = ApiAction(
        "PutObject", "Mug|+01.01|+00.90|+00.00", "Fridge|+02.10|+00.00|+00.00", force_action=True
    )
    put = {"action": "PutObject", "objectId": FRIDGE.object_id}
    assert call(api) == {**put, "forceAction": True, "placeStationary": True}


def test_an_object_that_the_scene_lacks():
    with pytest.raises(MissingObjectError, match=r"Cup\|"):
        call(ApiAction("PickupObject", "Cup|+01.00|+00.90|+00.00"))
