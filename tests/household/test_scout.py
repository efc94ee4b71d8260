"""Where to stand, on the embedded simulator."""

from infthor_eval.household.scout import find_viewpoint, reachable_grid


def test_an_object_is_shown_and_the_agent_is_back(simulator):
    view = simulator.reset("kitchen-3")
    grid = reachable_grid(simulator)
    here = simulator.view.agent
    items = [key for key, item in sorted(view.objects.items()) if item.pickupable][::3]
    viewpoints = [find_viewpoint(simulator, grid, [key], min_pixels=60) for key in items]
    assert any(viewpoints)
    assert simulator.view.agent == here
