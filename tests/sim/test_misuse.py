"""Nonsense arguments get an error in AI2-THOR's style, never a dead process."""

import math
from typing import Any

import pytest

from infthor_eval.sim.actions import bind, names
from infthor_eval.sim.errors import ActionError

from .harness import Bench

NONSENSE: list[Any] = [
    None, "a", "", 0, -1, 1e12, math.nan, math.inf, True, [], [1], ["a"], [{}], {}, {"x": "a"}, {"y": None},
    {"x": math.nan}, {"y": [1]}, [{"objectName": "Mug_1", "position": "a"}], [{"objectType": 1}],
]  # fmt: skip


@pytest.mark.parametrize("name", names())
def test_every_argument_of_every_action(name):
    bench = Bench(size=20)
    bench.reset("bathroom-1")
    some = bench.metadata["objects"][3]["objectId"]
    try:
        parameters = list(bind({"action": name})[0].parameters)
    except ActionError as error:
        parameters = [
            part.split()[-1] for part in error.message.split("Expected arguments: ")[1].split(". Your")[0].split(", ")
        ]  # fmt: skip
    usual = {"objectId": some, "sceneName": "bathroom-1", "fillLiquid": "water", "StateChange": "CanBeDirty", "seed": 1,
             "x": 100, "y": 100, "position": {"x": 0, "y": 1, "z": 0}, "rotation": {"y": 0}, "horizon": 0,
             "standing": True, "quality": "Low", "objectPoses": [], "objectToggles": [], "house": {},
             "SetObjectStates": {"stateChange": "openable"}}  # fmt: skip
    for parameter in parameters:
        for value in NONSENSE:
            arguments = {key: usual[key] for key in parameters if key in usual} | {parameter: value}
            bench.peer.act({"action": name, **arguments})
            if bench.sim.width * bench.sim.height > 10**6:
                bench.peer.act({"action": "ChangeResolution", "x": 20, "y": 20})
            del bench.sim.cameras[1:]
        metadata = bench.step(name, **({key: usual[key] for key in parameters if key in usual} | {parameter: "a"}))
        assert metadata["lastActionSuccess"] or metadata["errorMessage"]
        bench.ok("ChangeResolution", x=20, y=20)
        bench.reset("bathroom-1")


@pytest.mark.parametrize("message", [{}, {"action": 3}, {"action": None}, {"action": "reset"}, {"action": "__init__"}])
def test_messages_without_a_known_action(message):
    bench = Bench(size=20)
    outcome, _ = bench.peer.act(message)
    assert outcome.code == "InvalidAction"
