"""Wrong calls are answered in Unity's words, and never in Python's."""

import pytest

from infthor_sim.actions import action_names

from .harness import Bench


@pytest.fixture(scope="module")
def bench() -> Bench:
    new = Bench.at("bathroom-1", size=20)
    return new


@pytest.mark.parametrize(
    ("call", "message", "code"),
    [
        ({"action": "Fly"}, "Invalid action: Fly", "InvalidAction"),
        ({"action": "Reset"}, "action: Reset is missing the following arguments: sceneName",
         "MissingArguments"),
        ({"action": "OpenObject"}, "action: OpenObject is missing the following arguments: "
                                   "objectId",
         "MissingArguments"),
        ({"action": "OpenObject", "x": 0.5}, "action: OpenObject is missing the following "
                                             "arguments: y",
         "MissingArguments"),
        ({"action": "TeleportFull", "x": 0.5, "z": 1.0, "horizon": 0},
         "action: TeleportFull is missing the following arguments: rotation,standing,y",
         "MissingArguments"),
        ({"action": "AddThirdPartyCamera", "orthographicSize": {"x": 0}},
         'action: AddThirdPartyCamera has an invalid argument: orthographicSize (=={"x": 0}). '
         'Cannot convert to: float',
         "InvalidArgument"),
        ({"action": "LookUp", "degrees": "a"},
         "action: LookUp has an invalid argument: degrees (==a). Cannot convert to: float",
         "InvalidArgument"),
        ({"action": "ChangeResolution", "x": 1.5, "y": 2},
         "action: ChangeResolution has an invalid argument: x (==1.5). Cannot convert to: int",
         "InvalidArgument"),
        ({"action": "AddThirdPartyCamera", "position": 5},
         "Error converting value 5 to type 'Vector3'. Path 'position'.", None),
    ],
)  # fmt: skip
def test_wording(bench, call, message, code):
    bench.step(**call)
    assert (bench.metadata["errorMessage"], bench.metadata["errorCode"]) == (message, code)
    assert not bench.metadata["lastActionSuccess"]


def test_unknown_arguments_are_named_with_the_accepted_ones(kitchen):
    with pytest.raises(ValueError, match="called with invalid argument: 'z'") as raised:
        kitchen.step("PutObject", x=0.0, y=0.0, z=1.0, forceAction=False, placeStationary=True)
    message = str(raised.value)
    expected = "String objectId = , float x = , float y = , Boolean forceAction = False"
    assert f"Expected arguments: {expected}" in message
    assert "Your arguments: 'x', 'y', 'z', 'forceAction', 'placeStationary'" in message
    with pytest.raises(ValueError, match="invalid arguments: 'noise', 'pace'"):
        kitchen.step("MoveAhead", noise=1, pace=2)


@pytest.mark.parametrize("name", action_names())
def test_no_message_speaks_of_python(bench, name):
    message = bench.step(name, nonsense=None)["errorMessage"] if name != "Initialize" else ""
    assert not any(
        word in message for word in ("NoneType", "<class", "typing", " str ", " bool ", "dict")
    )


def test_an_error_has_a_code_only_where_unity_has_one(bench):
    assert bench.ok("Pass")["errorCode"] is None
    bench.refused("OpenObject", x=1.5, y=0.5)
    assert bench.metadata["errorMessage"].startswith("x/y must be in [0:1]")
    assert bench.metadata["errorCode"] is None


def test_flow_images_are_refused(kitchen):
    with pytest.raises(ValueError, match="renderFlowImage is not offered"):
        kitchen.step("Pass", renderFlowImage=True)


def test_the_transport_can_be_tried(kitchen):
    event = kitchen.last_event
    echoed = kitchen.step("TestFastEmit", rvalue="foo")
    assert echoed.metadata["actionReturn"] == "foo"
    assert echoed.metadata["objects"] is event.metadata["objects"]
    long = "a long argument " * 2000
    assert kitchen.step("TestActionReflectParam", rvalue=long).metadata["actionReturn"] == long
