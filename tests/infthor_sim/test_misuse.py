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


@pytest.mark.parametrize("name", action_names())
def test_every_argument_of_every_action(name):
    bench = Bench(size=20)
    bench.reset("bathroom-1")
    some = bench.metadata["objects"][3]["objectId"]
    try:
        parameters = list(bind({"action": name, "nonsense": 1})[0].parameters)
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
             "objectIds": [some], "maxPoses": 1}  # fmt: skip
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
        assert metadata["lastActionSuccess"] or metadata["errorMessage"]
        bench.ok("ChangeResolution", x=20, y=20)
        bench.reset("bathroom-1")


@pytest.mark.parametrize(
    "message", [{}, {"action": 3}, {"action": None}, {"action": "reset"}, {"action": "__init__"}]
)
def test_messages_with_an_unknown_action(message):
    bench = Bench(size=20)
    outcome, _ = bench.server.run(message)
    assert outcome.code == "InvalidAction"
