"""What can be asked of a scene: standing places, poses, outlines, points; what replies tell."""

import math
from itertools import product

import numpy as np
import pytest

from infthor_sim.agent import Agent
from infthor_sim.geometry import to_array
from infthor_sim.render.picture import compiled_rasterizer

from .harness import Bench
from .numpy_renderer import NUMPY


def positions(bench: Bench, **arguments: object) -> set[tuple[float, float]]:
    return {
        (p["x"], p["z"]) for p in bench.ok("GetReachablePositions", **arguments)["actionReturn"]
    }


def test_the_grid_of_reachable_positions(bench):
    usual, fine = positions(bench), positions(bench, gridSize=0.125)
    assert usual < fine
    assert len(fine) > 3 * len(usual)
    coarse = positions(bench, gridSize=0.5)
    assert coarse < usual
    bench.reset("kitchen-1", gridSize=0.125)
    assert positions(bench) == fine
    bench.refused("GetReachablePositions", gridSize=0)
    bench.refused("GetReachablePositions", maxStepCount=1)


def test_reachable_positions_in_the_directions_of_the_agent(bench):
    usual = positions(bench)
    bench.ok("RotateRight", degrees=30)
    assert positions(bench) == usual
    turned = positions(bench, directionsRelativeAgent=True)
    here = bench.metadata["agent"]["position"]
    assert len(turned) > len(usual) / 2
    for x, z in turned:
        dx, dz, angle = x - here["x"], z - here["z"], math.radians(30)
        ahead, aside = (
            dx * math.sin(angle) + dz * math.cos(angle),
            dx * math.cos(angle) - dz * math.sin(angle),
        )
        assert abs(ahead / 0.25 - round(ahead / 0.25)) < 1e-3
        assert abs(aside / 0.25 - round(aside / 0.25)) < 1e-3


def test_every_interactable_pose_sees_the_object(bench):
    fridge = bench.first("Fridge")
    poses = bench.ok("GetInteractablePoses", fridge, horizons=[0, 30])["actionReturn"]
    assert len(poses) > 20
    assert set(poses[0]) == {"x", "y", "z", "rotation", "standing", "horizon"}
    for pose in poses[:: len(poses) // 8]:
        bench.ok("TeleportFull", **{**pose, "rotation": {"y": pose["rotation"]}})
        assert bench.object(fridge)["visible"]


@pytest.mark.parametrize("rasterizer", [compiled_rasterizer(), NUMPY], ids=["numba", "numpy"])
@pytest.mark.parametrize(
    ("scene", "kinds"), [("kitchen-2", ("Fridge", "Faucet")), ("bathroom-1", ("Sink", "Towel"))]
)
def test_interactable_poses_are_those_whose_inner_picture_shows_the_object(
    rasterizer, scene, kinds
):
    bench, inner = Bench(size=40), Bench(size=40)
    bench.reset(scene)
    usual = bench.sim.settings.field_of_view
    inner.reset(
        scene, fieldOfView=math.degrees(2 * math.atan(0.8 * math.tan(math.radians(usual) / 2)))
    )
    for one in (bench, inner):
        one.sim.display.rasterizer = rasterizer
    places = bench.ok("GetReachablePositions")["actionReturn"][::24]
    for target in map(bench.first, kinds):
        poses = bench.ok("GetInteractablePoses", target, positions=places)["actionReturn"]
        slow = []
        for pose in product(
            places, (-30.0, 0.0, 30.0, 60.0), (0.0, 90.0, 180.0, 270.0), (True, False)
        ):
            place, tilt, turn, standing = pose
            inner.sim.world.agents[0] = Agent(to_array(place), turn, tilt, standing)
            if target in inner.sim.vision.visible_ids():
                slow.append({**place, "rotation": turn, "standing": standing, "horizon": tilt})
        assert poses == slow
        assert slow


def test_interactable_poses_can_be_narrowed(bench):
    fridge = bench.first("Fridge")
    every = bench.ok("GetInteractablePoses", fridge, maxPoses=9)["actionReturn"]
    assert bench.ok("GetInteractablePoses", fridge, maxPoses=5)["actionReturn"] == every[:5]
    some = bench.ok(
        "GetInteractablePoses",
        fridge,
        rotations=[0, 45],
        horizons=[0],
        standings=[True],
        maxDistance=4,
    )["actionReturn"]
    assert all(p["rotation"] in (0, 45) and p["horizon"] == 0 and p["standing"] for p in some)
    place = {key: every[0][key] for key in "xyz"}
    here = bench.ok("GetInteractablePoses", fridge, positions=[place])["actionReturn"]
    assert here
    assert all(place.items() <= pose.items() for pose in here)
    inside = next(
        o.object_id for o in bench.sim.world.objects.values() if bench.sim.world.is_hidden(o)
    )
    assert bench.ok("GetInteractablePoses", inside)["actionReturn"] == []


def test_outlines_from_above(bench):
    table = bench.first("DiningTable")
    hull = np.array(bench.ok("Get2DSemanticHull", table)["actionReturn"])
    corners = np.array(bench.object(table)["axisAlignedBoundingBox"]["cornerPoints"])[:, [0, 2]]
    assert hull.shape == (4, 2)
    assert sorted(map(tuple, hull.round(3))) == sorted({tuple(c) for c in corners.round(3)})
    every = bench.ok("Get2DSemanticHulls")["actionReturn"]
    assert set(every) == {o["objectId"] for o in bench.metadata["objects"]}
    some = bench.ok("Get2DSemanticHulls", objectTypes=["Fridge", "Mug"])["actionReturn"]
    assert {name.split("|")[0] for name in some} == {"Fridge", "Mug"}
    assert list(bench.ok("Get2DSemanticHulls", objectIds=[table])["actionReturn"]) == [table]
    bench.refused("Get2DSemanticHulls", objectIds=[table], objectTypes=["Mug"])


def test_points_in_the_frame(bench):
    fridge = bench.first("Fridge")
    bench.stand_before(fridge)
    camera = bench.metadata["cameraPosition"]
    picture = bench.sim.views.agent_view()
    for x, y in ((0.5, 0.5), (0.2, 0.7), (0.8, 0.3)):
        point = bench.ok("GetCoordinateFromRaycast", x=x, y=y)["actionReturn"]
        away = np.array([point[k] - camera[k] for k in "xyz"]) @ picture.camera.matrix
        depth = picture.depth[int((1 - y) * 60), int(x * 60)]
        assert away[2] == pytest.approx(depth, rel=0.05)
        slope = math.tan(math.radians(30))
        # The camera is where the metadata says, to 5 digits.
        assert away[0] / away[2] / slope == pytest.approx(2 * x - 1, abs=2e-5)
        assert away[1] / away[2] / slope == pytest.approx(1 - 2 * y, abs=2e-5)
    for x, y in ((1.5, 0.5), (-0.1, 0.8)):
        assert "must be in [0:1]" in bench.refused("GetCoordinateFromRaycast", x=x, y=y)


def test_a_wall_is_no_object(bench):
    seen = set()
    for _ in range(4):
        bench.ok("RotateRight")
        for x, y in ((0.5, 0.02), (0.5, 0.3), (0.1, 0.1), (0.5, 0.6)):
            reply = bench.step("GetObjectInFrame", x=x, y=y)
            seen.add(reply["lastActionSuccess"])
            if reply["lastActionSuccess"]:
                assert reply["actionReturn"] in bench.sim.world.objects
            else:
                assert reply["errorMessage"] == f"no sim objects found at ({x},{y})"
    assert seen == {True, False}


def test_replies_list_the_filtered_objects_only(bench):
    every = [o["objectId"] for o in bench.metadata["objects"]]
    kept = [bench.first("Fridge"), bench.first("Mug")]
    listed = bench.ok("SetObjectFilter", objectIds=kept)["objects"]
    assert {o["objectId"] for o in listed} == set(kept)
    assert bench.ok("SetObjectFilter", objectIds=[])["objects"] == []
    bench.force("OpenObject", kept[0])
    assert [o["objectId"] for o in bench.ok("ResetObjectFilter")["objects"]] == every
    assert bench.object(kept[0])["isOpen"]
    bench.ok("SetObjectFilter", objectIds=[])
    assert len(bench.reset("kitchen-1")["objects"]) == len(every)
