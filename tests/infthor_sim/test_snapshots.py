import copy
import json

import pytest

from .harness import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench.at("kitchen-2")


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
    bench.ok("RotateRight")
    bench.ok("InitialRandomSpawn", randomSeed=3)
    for item in list(bench.sim.world.objects.values()):
        if item.type.openable:
            bench.force("OpenObject", item.object_id)
            return


def test_what_was_saved_comes_back_whole_and_more_than_once(bench):
    bench.ok("SaveState")
    before = state(bench)
    for _ in range(2):
        change(bench)
        assert state(bench) != before
        bench.ok("RestoreState")
        assert state(bench) == before


def test_after_coming_back_the_same_actions_have_the_same_outcome(bench):
    bench.ok("SaveState")
    change(bench)
    after = copy.deepcopy(state(bench))
    bench.ok("RestoreState")
    change(bench)
    assert state(bench) == after


def test_nothing_saved_and_a_saved_state_of_another_scene_are_refused(bench):
    assert "no saved state" in bench.refused("RestoreState")
    bench.ok("SaveState")
    bench.ok("Reset", sceneName="kitchen-3")
    assert "no saved state" in bench.refused("RestoreState")


def test_slots_are_kept_apart(bench):
    bench.ok("SaveState", slot=0)
    first = state(bench)
    change(bench)
    bench.ok("SaveState", slot=1)
    second = state(bench)
    assert first != second
    bench.ok("RestoreState", slot=0)
    assert state(bench) == first
    bench.ok("RestoreState", slot=1)
    assert state(bench) == second
    assert "no saved state" in bench.refused("RestoreState", slot=2)
