"""What AI2-THOR's own tests state about FloorPlan28, the scene that they are written for."""

import pytest

from infthor_sim.scenes.catalogue import Catalogue

from .conftest import need_data
from .harness import Bench

FLOOR = 0.901


@pytest.fixture(scope="module")
def plan() -> Bench:
    return Bench(Catalogue(need_data()), size=300)


@pytest.fixture
def bench(plan) -> Bench:
    plan.reset("FloorPlan28", fieldOfView=90)
    return plan


def test_the_agent_starts_where_ai2thor_puts_it(bench):
    agent = bench.metadata["agent"]
    place = agent["position"]
    assert (place["x"], place["z"], agent["rotation"]["y"]) == (-1.5, -1.5, 180)


@pytest.mark.parametrize("place", [(-1.0, -0.5), (-1.0, -1.25), (-1.0, -2.25)])
def test_the_agent_can_stand_beside_closed_doors_and_drawers(bench, place):
    bench.teleport(*place, 90)
    fridge = bench.first("Fridge")
    if place == (-1.0, -0.5):
        assert bench.object(fridge)["visible"]
        bench.ok("OpenObject", fridge)


@pytest.mark.parametrize("place", [(-1.5, -3.5), (-1.5, 0.0)])
def test_furniture_and_walls_still_refuse_a_teleport(bench, place):
    bench.refused("Teleport", position={"x": place[0], "y": FLOOR, "z": place[1]})


def test_positions_along_the_agents_own_axes_differ(bench):
    aligned = bench.ok("GetReachablePositions")["actionReturn"]
    bench.teleport(-1.0, -1.25, 49.11111)
    assert bench.ok("GetReachablePositions")["actionReturn"] == aligned
    turned = bench.ok("GetReachablePositions", directionsRelativeAgent=True)["actionReturn"]
    assert 100 < len(aligned) < 125
    assert 100 < len(turned) < 125
    assert len(turned) != len(aligned)


def test_poses_that_see_the_fridge(bench):
    fridge = bench.first("Fridge")
    poses = bench.ok("GetInteractablePoses", fridge)["actionReturn"]
    assert 400 < len(poses) < 600
    far = bench.ok("GetInteractablePoses", fridge, maxDistance=5)["actionReturn"]
    assert 1100 < len(far) < 1300
    assert bench.ok("GetInteractablePoses", fridge, rotations=[270])["actionReturn"] == []
    for pose in poses[::40]:
        bench.ok("TeleportFull", **{**pose, "rotation": {"x": 0, "y": pose["rotation"], "z": 0}})
        assert bench.object(fridge)["visible"]


@pytest.mark.parametrize(
    ("turn", "rotation"),
    [({"pitch": 90}, (90, 180, 0)), ({"yaw": 90}, (0, 270, 0)), ({"roll": 90}, (0, 180, 270)),
     ({"pitch": 90, "yaw": 90, "roll": 90}, (90, 0, 0))],
)  # fmt: skip
@pytest.mark.parametrize("tilt", [0, 40])
def test_the_hand_turns_by_its_own_angles(bench, turn, rotation, tilt):
    bottle = bench.first("SoapBottle")
    # lying otherwise in the hand changes nothing
    bench.sim.world.objects[bottle].rotation[2] = tilt
    bench.force("PickupObject", bottle)
    before = bench.metadata["heldObjectPose"]
    after = bench.ok("RotateHeldObject", **turn)["hand"]
    assert before["localRotation"] == {"x": 0, "y": 0, "z": 0}
    assert list(after["rotation"].values()) == pytest.approx(list(rotation), abs=1e-3)
    assert after["position"] == before["position"]


@pytest.mark.parametrize(
    ("angle", "axis", "sign"),
    [(0, "z", 1), (90, "x", 1), (180, "z", -1), (270, "x", -1), (-1, "z", 1), (-90, "x", -1)],
)
def test_a_push_moves_a_tomato_far_and_what_is_in_its_way_along(bench, angle, axis, sign):
    bench.teleport(-3.25, -1.25, horizon=30)
    tomato, bread = bench.first("Tomato"), bench.first("Bread")
    before, stood = bench.object(tomato)["position"], bench.object(bread)["position"]
    bench.ok("DirectionalPush", tomato, pushAngle=angle, moveMagnitude=25)
    assert sign * (bench.object(tomato)["position"][axis] - before[axis]) > 0.2
    # The bread lies 14 cm beside it, towards -x.
    assert (bench.object(bread)["position"] != stood) == ((axis, sign) == ("x", -1))


@pytest.mark.parametrize(
    ("at", "point"),
    [((0.5, 0.5), (-0.3443, 1.576, -1.5)), ((0.5, 0.2), (-0.3443, 2.2694, -1.5)),
     ((0.25, 0.5), (-0.5968, 1.576, -1.0484))],
)  # fmt: skip
def test_the_point_that_a_ray_from_the_screen_hits(bench, at, point):
    bench.teleport(-1.5, -1.5, 90)
    hit = bench.ok("GetCoordinateFromRaycast", x=at[0], y=at[1])["actionReturn"]
    assert list(hit.values()) == pytest.approx(point, abs=1e-3)
