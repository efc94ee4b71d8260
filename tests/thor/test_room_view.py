"""The view that shows a room: more of it than the agent's first."""

import pytest

from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.scenes import find_room_view
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, Vector, teleport_call

SIZE = 100


@pytest.fixture(scope="module")
def simulator():
    with Simulator(embedded_launch(None), width=SIZE, height=SIZE) as running:
        yield running


def n_seen(view: SimulatorView) -> int:
    assert view.instances is not None
    return sum(instance.pixels >= 10 for instance in view.instances.values())


@pytest.mark.parametrize(
    "scene", ["kitchen-1", "living-room-4", "bedroom-5", "bathroom-3", "house-3"]
)
def test_it_shows_several_times_as_many_objects_as_the_first_frame(simulator, scene):
    first = simulator.reset(scene)
    places = [Vector(**place) for place in simulator.query("GetReachablePositions").result]
    pose = find_room_view(simulator, places, SIZE * SIZE)
    assert simulator.view.agent == first.agent
    assert any(
        abs(place.x - pose.position.x) + abs(place.z - pose.position.z) < 0.01 for place in places
    )
    room_view = simulator.query(**teleport_call(pose))
    assert room_view.success
    assert n_seen(room_view) >= 2 * n_seen(first)
    assert n_seen(room_view) >= 8
    largest = max(instance.pixels for instance in room_view.instances.values())
    assert largest < 0.4 * SIZE * SIZE


def test_the_same_scene_has_the_same_view(simulator):
    poses = []
    for _ in range(2):
        simulator.reset("bathroom-1")
        places = [Vector(**place) for place in simulator.query("GetReachablePositions").result]
        poses.append(find_room_view(simulator, places, SIZE * SIZE))
    assert poses[0] == poses[1]


def test_without_a_place_to_go_it_is_the_agents_own_view(simulator):
    simulator.reset("bathroom-1")
    assert find_room_view(simulator, [], SIZE * SIZE) == simulator.view.agent
