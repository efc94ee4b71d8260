"""Where to stand, on the embedded simulator."""

import pytest

from infthor_eval.household.scout import find_viewpoint, reachable_grid
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator


@pytest.fixture(scope="module")
def simulator():
    with Simulator(embedded_launch()) as simulator:
        yield simulator


def test_an_object_is_shown_and_the_agent_is_back(simulator):
    view = simulator.reset("kitchen-3")
    grid = reachable_grid(simulator)
    here = simulator.view.agent
    items = [key for key, item in sorted(view.objects.items()) if item.pickupable][::3]
    found = [find_viewpoint(simulator, grid, [key], min_pixels=60) for key in items]
    assert any(found)
    assert simulator.view.agent == here
