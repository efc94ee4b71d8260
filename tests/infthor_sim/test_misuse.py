"""Nonsense arguments get an error in AI2-THOR's style, never a dead process."""

import math
from typing import Any

import pytest

from infthor_sim.actions import action_names, bind
from infthor_sim.errors import ActionError

from .harness import Bench

NONSENSE: list[Any] = [
    None, "a", "", 0, -1, 1e12, math.nan, math.inf, True, [], [1], ["a"], [{}], {}, {"x": "a"},
    {"y": None},
    {"x": math.nan}, {"y": [1]}, [{"objectName": "Mug_1", "position": "a"}], [{"objectType": 1}],
]  # fmt: skip


OWN = [*sorted(set(action_names("arm")) - set(action_names()))]
OWN += ["PickupObject", "MoveAhead", "RotateLeft"]  # they are other actions with an arm
CALLS = [("default", name) for name in action_names()]
CALLS += [(mode, name) for mode in ("arm", "stretch") for name in OWN if name in action_names(mode)]


@pytest.mark.parametrize(("mode", "name"), CALLS)
def test_every_argument_of_every_action(mode, name):
    bench = Bench.at("bathroom-1", size=20, agentMode=mode)
    some = bench.metadata["objects"][3]["objectId"]
    try:
        parameters = list(bind({"action": name, "nonsense": 1}, mode)[0].parameters)
    except ActionError as error:
        listed = error.message.split("Expected arguments: ")[1].split("\n")[0]
        parameters = [part.split(" = ")[0].split()[-1] for part in listed.split(", ") if part]
    usual = {"objectId": some, "sceneName": "bathroom-1", "fillLiquid": "water",
             "StateChange": "CanBeDirty", "seed": 1,
             "x": 100, "y": 100, "position": {"x": 0, "y": 1, "z": 0}, "rotation": {"y": 0},
             "horizon": 0,
             "standing": True, "quality": "Low", "objectPoses": [], "objectToggles": [],
             "house": {},
             "SetObjectStates": {"stateChange": "openable"}, "rvalue": "a", "moveMagnitude": 0.1,
             "pushAngle": 0,
             "objectIds": [some], "maxPoses": 1, "offset": {"x": 0.05}, "distance": 0.05,
             "degrees": 10, "radius": 0.1, "point": {"x": 0}, "ahead": 0.1}  # fmt: skip
    if mode != "default":
        usual |= {"position": {"x": 0, "y": 0, "z": 0.5}, "y": 0.5}
    for parameter in parameters:
        given = {key: usual[key] for key in parameters if key in usual}
        if {"objectId", "position"} & set(given):  # an action of two forms takes the other instead
            given = {key: value for key, value in given.items() if key not in {"x", "y", "z"}}
        for value in NONSENSE:
            bench.server.run({"action": name, **given, parameter: value})
            if bench.sim.display.width * bench.sim.display.height > 10**6:
                bench.server.run({"action": "ChangeResolution", "x": 20, "y": 20})
            del bench.sim.cameras[1:]
        metadata = bench.step(name, **(given | {parameter: "a"}))
        message = metadata["errorMessage"]
        assert metadata["lastActionSuccess"] or message
        assert not any(word in message for word in ("NoneType", "<class", "typing", "Traceback"))
        bench.ok("ChangeResolution", x=20, y=20)
        bench.reset("bathroom-1", agentMode=mode)


def test_the_modes_differ_where_unity_s_do():
    assert set(action_names()) <= set(action_names("arm"))
    assert set(action_names("stretch")) < set(action_names("arm"))
    assert "RotateElbowRelative" not in action_names("stretch") and "MoveArm" not in action_names()


@pytest.mark.parametrize(
    "message", [{}, {"action": 3}, {"action": None}, {"action": "reset"}, {"action": "__init__"}]
)
def test_messages_with_an_unknown_action(message):
    bench = Bench(size=20)
    outcome, _ = bench.server.run(message)
    assert outcome.code == "InvalidAction"
