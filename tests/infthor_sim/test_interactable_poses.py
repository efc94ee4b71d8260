"""GetInteractablePoses against its answers before it asked about many directions at once."""

import hashlib
import json

import pytest

from .harness import Bench

# By scene and type of object: number of poses and digest of the whole answer.
ANSWERS = {
    ("kitchen-1", "Fridge"): (392, "b72c4fcd2978539e"),
    ("kitchen-1", "Faucet"): (78, "87f3875573b39dae"),
    ("bathroom-1", "Sink"): (132, "60ebdcd33ebf1020"),
    ("bathroom-1", "Towel"): (103, "6aa0347e4bab27b7"),
    ("bedroom-2", "Bed"): (839, "73548e9165a0ead3"),
    ("bedroom-2", "Laptop"): (142, "51bfd6592f31b81d"),
}


def answer(bench: Bench, object_type: str, **arguments: object) -> tuple[int, str]:
    poses = bench.ok("GetInteractablePoses", bench.first(object_type), **arguments)["actionReturn"]
    return len(poses), hashlib.sha256(json.dumps(poses).encode()).hexdigest()[:16]


@pytest.mark.parametrize("scene", ["kitchen-1", "bathroom-1", "bedroom-2"])
def test_answers_are_what_they_were(scene):
    bench = Bench.at(scene, size=300)
    kinds = {kind: value for (where, kind), value in ANSWERS.items() if where == scene}
    assert {kind: answer(bench, kind) for kind in kinds} == kinds


def test_a_camera_off_the_middle_of_its_agent_moves_as_it_turns():
    bench = Bench.at("kitchen-3", agentMode="stretch", size=60)
    turns = {"horizons": [-13, 0, 22.5], "rotations": [0, 33, -90, 405]}
    assert answer(bench, "Fridge", **turns) == (286, "aa2fde077554654c")


@pytest.mark.parametrize("empty", ["horizons", "rotations", "standings", "positions"])
def test_nothing_is_seen_from_nowhere(empty):
    bench = Bench.at("kitchen-1", size=20)
    assert answer(bench, "Fridge", **{empty: []})[0] == 0
