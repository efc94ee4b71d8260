import copy
import json
from typing import Any

import pytest

from infthor_sim.scenes.catalogue import Catalogue

from .harness import INIT, Bench


@pytest.fixture
def bench() -> Bench:
    bench = Bench(Catalogue(None, None), size=100)
    act(bench, action="Reset", sceneName="kitchen-2")
    act(bench, action="Initialize", **INIT)
    return bench


def act(bench: Bench, **call: Any) -> Any:
    outcome = bench.server.run(call)[0]
    assert not outcome.error, outcome.error
    return outcome


def state(bench: Bench) -> tuple[str, bytes, bytes]:
    """Everything that a reply would show: metadata and both pictures."""
    picture = bench.sim.views.agent_frame()
    objects = {
        name: (item.position.tolist(), item.rotation.tolist(), item.parent, repr(item.state))
        for name, item in bench.sim.world.objects.items()
    }
    agent = bench.sim.world.agent
    text = json.dumps(
        [objects, agent.position.tolist(), agent.yaw, agent.horizon, agent.held],
        sort_keys=True,
    )
    return text, bench.sim.views.colours(picture).tobytes(), picture.instances.tobytes()


def change(bench: Bench) -> None:
    """Move, open everything, spill everything, and put things elsewhere."""
    act(bench, action="RotateRight")
    act(bench, action="InitialRandomSpawn", randomSeed=3)
    for item in list(bench.sim.world.objects.values()):
        if item.type.openable:
            act(bench, action="OpenObject", objectId=item.object_id, forceAction=True)
            return


def test_what_was_saved_comes_back_whole_and_more_than_once(bench: Bench) -> None:
    act(bench, action="SaveState")
    before = state(bench)
    for _ in range(2):
        change(bench)
        assert state(bench) != before
        act(bench, action="RestoreState")
        assert state(bench) == before


def test_after_coming_back_the_same_actions_have_the_same_outcome(bench: Bench) -> None:
    act(bench, action="SaveState")
    change(bench)
    after = copy.deepcopy(state(bench))
    act(bench, action="RestoreState")
    change(bench)
    assert state(bench) == after


def test_nothing_saved_and_a_saved_state_of_another_scene_are_refused(bench: Bench) -> None:
    assert "no saved state" in bench.server.run({"action": "RestoreState"})[0].error
    act(bench, action="SaveState")
    act(bench, action="Reset", sceneName="kitchen-3")
    assert "no saved state" in bench.server.run({"action": "RestoreState"})[0].error


def test_slots_are_kept_apart(bench: Bench) -> None:
    act(bench, action="SaveState", slot=0)
    first = state(bench)
    change(bench)
    act(bench, action="SaveState", slot=1)
    second = state(bench)
    assert first != second
    act(bench, action="RestoreState", slot=0)
    assert state(bench) == first
    act(bench, action="RestoreState", slot=1)
    assert state(bench) == second
    assert "no saved state" in bench.server.run({"action": "RestoreState", "slot": 2})[0].error
