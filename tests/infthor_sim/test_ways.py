"""GetShortestPath, GetShortestPathToPoint, and the expert: where ways end, and what is refused."""

import itertools
import math
import random
from collections import deque

import pytest

from infthor_sim.scenes.catalogue import Catalogue

from .conftest import need_data
from .harness import Bench

Place = tuple[float, float]
STARTS, OBJECTS = 3, 5  # of each scene


def place_of(point: dict[str, float]) -> Place:
    """(x, z) in cells, to a hundredth: recordings are rounded."""
    return round(point["x"] * 4, 2), round(point["z"] * 4, 2)


def searched_end(bench: Bench, start: Place, goal: str) -> tuple[Place, int] | None:
    """The first place from which an object is interactable, and its number of steps."""
    reachable = {place_of(p) for p in bench.ok("GetReachablePositions")["actionReturn"]}
    good = {place_of(p) for p in bench.ok("GetInteractablePoses", goal)["actionReturn"]}
    steps = {start: 0}
    queue = deque([start])
    while queue:
        here = queue.popleft()
        if here in good:
            return here, steps[here]
        for x, z in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            there = (round(here[0] + x, 2), round(here[1] + z, 2))
            if there in reachable and there not in steps:
                steps[there] = steps[here] + 1
                queue.append(there)
    return None


def metres(corners: list[dict[str, float]]) -> float:
    return sum(
        math.dist((a["x"], a["z"]), (b["x"], b["z"])) for a, b in itertools.pairwise(corners)
    )


@pytest.mark.parametrize(
    "scene", ["kitchen-1", "bedroom-2", "bathroom-1", "house-2", "FloorPlan28"]
)
def test_a_way_ends_where_a_search_on_foot_first_meets_a_place_to_interact_from(scene):
    recorded = scene.startswith("FloorPlan")
    bench = Bench.at(scene, 40, Catalogue(need_data()) if recorded else None)
    rng = random.Random(scene)
    places = bench.ok("GetReachablePositions")["actionReturn"]
    for start in rng.sample(places, STARTS):
        bench.ok("Teleport", position=start)
        for item in rng.sample([o["objectId"] for o in bench.metadata["objects"]], OBJECTS):
            found = searched_end(bench, place_of(start), item)
            metadata = bench.step("GetShortestPath", item)
            if found is None:
                assert "is not visible on navigation path" in metadata["errorMessage"]
                continue
            corners = metadata["actionReturn"]["corners"]
            assert place_of(corners[0]) == place_of(start)
            assert place_of(corners[-1]) == found[0]
            assert metres(corners) == pytest.approx(0.25 * found[1], abs=1e-3)


def test_a_way_starts_at_position_and_is_one_place_where_the_object_is_in_reach(bench):
    fridge = bench.first("Fridge")
    corners = bench.ok("GetShortestPath", fridge)["actionReturn"]["corners"]
    assert len(corners) > 1
    end = corners[-1]
    assert bench.ok("GetShortestPath", fridge, position=end)["actionReturn"]["corners"] == [end]
    there = bench.ok("GetShortestPathToPoint", target=end)["actionReturn"]["corners"]
    assert there[-1] == end
    back = bench.ok("GetShortestPathToPoint", **corners[0], position=end)["actionReturn"]["corners"]
    assert back[0] == end
    assert back[-1] == corners[0]


def test_one_of_several_objects_of_a_type_is_not_chosen(bench):
    for action in ("GetShortestPath", "ObjectNavExpertAction"):
        assert "Multiple objects of type Cabinet" in bench.refused(action, objectType="Cabinet")
        assert "was not found in the scene" in bench.refused(action, objectType="Ghost")
        assert "was not found in the scene" in bench.refused("GetShortestPath")
    bench.ok("GetShortestPath", objectType="Fridge")


def test_ways_begin_and_end_near_where_one_can_stand(bench):
    here = bench.metadata["agent"]["position"]
    far = {**here, "x": here["x"] + 30}
    fridge = bench.first("Fridge")
    for action in ("GetShortestPathToPoint", "ObjectNavExpertAction"):
        name = "target" if action == "GetShortestPathToPoint" else "position"
        assert "No point on NavMesh near targetPosition" in bench.refused(action, **{name: far})
        for y in (50, -1):
            message = bench.refused(action, **{name: {**here, "y": y}})
            assert "could not find the floor from position" in message
    for action, goal in (("GetShortestPath", {"objectId": fridge}),
                         ("GetShortestPathToPoint", {"target": here})):  # fmt: skip
        message = bench.refused(action, **goal, position=far)
        assert "No point on NavMesh near startPosition" in message
        bench.refused(action, **goal, position={**here, "y": 50})


def test_an_allowed_error_is_how_far_off_both_ends_may_be(bench):
    nav = bench.sim.world.nav
    x, z = max(nav)  # at a wall to the right
    beside, y = x + 0.28, bench.metadata["agent"]["position"]["y"]
    assert 0 < nav.gap(beside, z) < 0.2
    off = {"x": beside, "y": y, "z": z}
    bench.ok("GetShortestPathToPoint", target=off)
    message = bench.refused("GetShortestPathToPoint", target=off, position=off)
    assert message.startswith("Closest point on NavMesh was too far from the agent")
    bench.ok("GetShortestPathToPoint", target=off, position=off, allowedError=0.2)
    wide = {**off, "x": x + 0.6}
    bench.refused("GetShortestPathToPoint", target=wide)
    bench.ok("GetShortestPathToPoint", target=wide, allowedError=0.5)
    bench.ok("GetShortestPath", bench.first("Fridge"), position=off)


@pytest.mark.parametrize(("size", "step"), [(0.5, 90), (0.25, 120), (0.5, 45)])
def test_an_expert_that_is_stuck_does_not_say_that_it_is_done(size, step):
    bench = Bench.at("bathroom-1", 20, gridSize=size, rotateStepDegrees=step)
    y = bench.metadata["agent"]["position"]["y"]
    for x, z in (min(bench.sim.world.nav), max(bench.sim.world.nav)):
        for _ in range(100):
            reply = bench.step("ObjectNavExpertAction", position={"x": x, "y": y, "z": z})
            if not reply["lastActionSuccess"]:
                assert "Can't seem to move nearer" in reply["errorMessage"]
                break
            if reply["actionReturn"] is None:
                here = bench.metadata["agent"]["position"]
                assert math.dist((here["x"], here["z"]), (x, z)) <= size
                break
            bench.ok(reply["actionReturn"])
        else:
            pytest.fail("it goes on for ever")
