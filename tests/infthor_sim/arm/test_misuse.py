"""Nonsense arguments to the arm agents' actions get an error in AI2-THOR's style."""

import pytest

from infthor_sim.actions import action_names, bind
from infthor_sim.errors import ActionError

from ..test_misuse import NONSENSE
from .harness import arm_bench

OWN = [
    *sorted(set(action_names("arm")) - set(action_names())),
    "PickupObject",
    "MoveAhead",
    "RotateLeft",
]
USUAL = {"position": {"x": 0, "y": 0, "z": 0.5}, "offset": {"x": 0.05}, "y": 0.5, "distance": 0.05,
         "degrees": 10,
         "radius": 0.1, "point": {"x": 0}, "ahead": 0.1}  # fmt: skip


@pytest.mark.parametrize("mode", ["arm", "stretch"])
@pytest.mark.parametrize("name", OWN)
def test_every_argument_of_every_action(mode, name):
    if name not in action_names(mode):
        pytest.skip("the stretch robot has no elbow")
    bench = arm_bench("bathroom-1", size=20, agentMode=mode)
    try:
        parameters = list(bind({"action": name, "nonsense": 1}, mode)[0].parameters)
    except ActionError as error:
        listed = error.message.split("Expected arguments: ")[1].split("\n")[0]
        parameters = [part.split(" = ")[0].split()[-1] for part in listed.split(", ") if part]
    for parameter in parameters:
        given = {key: USUAL[key] for key in parameters if key in USUAL}
        for value in NONSENSE:
            bench.server.run({"action": name, **given, parameter: value})
        metadata = bench.step(name, **(given | {parameter: "a"}))
        assert metadata["lastActionSuccess"] or metadata["errorMessage"]
        assert not any(
            word in metadata["errorMessage"]
            for word in ("NoneType", "<class", "typing", "Traceback")
        )


def test_the_modes_differ_where_unity_s_do():
    assert set(action_names()) <= set(action_names("arm"))
    assert set(action_names("stretch")) < set(action_names("arm"))
    assert "RotateElbowRelative" not in action_names("stretch") and "MoveArm" not in action_names()
