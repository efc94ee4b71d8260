"""Teleporting, turning to a pose, and the terms of moves, as AI2-THOR documents them."""

import pytest

from .harness import Bench


def there(bench: Bench) -> dict[str, float]:
    """A cell other than the agent's."""
    here = bench.metadata["agent"]["position"]
    cells = bench.step("GetReachablePositions")["actionReturn"]
    return next(cell for cell in cells if (cell["x"], cell["z"]) != (here["x"], here["z"]))


def test_the_agent_is_put_on_the_floor(bench):
    floor, place = bench.metadata["agent"]["position"]["y"], there(bench)
    bench.ok("Teleport", position={**place, "y": floor + 0.04})
    assert bench.metadata["agent"]["position"] == pytest.approx({**place, "y": floor}, abs=1e-5)


@pytest.mark.parametrize("off", [0.06, 1.0, -0.06])
def test_a_place_off_the_floor_is_refused_unless_forced(bench, off):
    before, place = bench.metadata["agent"], there(bench)
    message = bench.refused("Teleport", position={**place, "y": place["y"] + off})
    assert "too large a change" in message
    assert "y component" in message
    assert bench.metadata["agent"] == before
    bench.force("Teleport", position={**place, "y": place["y"] + off})
    assert bench.metadata["agent"]["position"]["y"] == pytest.approx(place["y"] + off, abs=1e-5)


def test_coordinates_may_be_given_one_by_one(bench):
    place = there(bench)
    bench.ok("TeleportFull", **place, rotation={"y": 90}, horizon=30, standing=False)
    agent = bench.metadata["agent"]
    assert agent["position"] == pytest.approx(place, abs=1e-5)
    assert (agent["rotation"]["y"], agent["cameraHorizon"], agent["isStanding"]) == (90, 30, False)
    bench.refused("Teleport", x=place["x"], z=place["z"])
    missing = "action: Teleport is missing the following arguments: y"
    assert bench.metadata["errorMessage"] == missing
    bench.refused(
        "TeleportFull", position=place, x=0, rotation={"y": 90}, horizon=30, standing=True
    )
    assert bench.metadata["errorCode"] == "InvalidArgument"


def test_what_a_teleport_does_not_name_stays(bench):
    before = bench.ok("RotateRight")["agent"]
    after = bench.ok("Teleport", horizon=10)["agent"]
    assert after == {**before, "cameraHorizon": 10}


def test_rotate_look(kitchen):
    before = kitchen.last_event.metadata["agent"]
    after = kitchen.step("RotateLook", rotation=90, horizon=31).metadata["agent"]
    assert after["position"] == before["position"]
    assert after["rotation"] == {"x": 0, "y": 90, "z": 0}
    assert after["cameraHorizon"] == 31


@pytest.mark.parametrize("move", ["MoveAhead", "MoveBack", "MoveLeft", "MoveRight"])
def test_a_move_needs_a_positive_length(bench, move):
    for magnitude in (0, -0.25):
        assert bench.refused(move, moveMagnitude=magnitude) == "moveMagnitude must be > 0"
        assert bench.metadata["errorCode"] is None


def test_a_move_takes_all_of_unitys_arguments(bench):
    of_all = {"speed": 2.0, "returnToStart": True, "disableRendering": True}
    of_moves = {"manualInteract": False, "objectId": "", "maxAgentsDistance": -1.0}
    of_moves |= {"allowAgentsToIntersect": False, "forceAction": False}
    assert not bench.step("MoveAhead", moveMagnitude=0.25, **of_all, **of_moves)["errorCode"]
    assert not bench.step("RotateLeft", **of_all)["errorCode"]
    for look in ("LookDown", "LookUp"):
        bench.ok(look, degrees=15, speed=2.0)


@pytest.mark.parametrize("action", ["MoveAhead", "RotateLeft", "LookDown", "Crouch", "Pass"])
def test_a_time_of_simulation_has_no_effect(bench, action):
    bench.ok(action, actionSimulationSeconds=0.26, fixedDeltaTime=0.02)


def test_a_leash_keeps_the_agent_near_an_object(bench):
    fridge = bench.first("Fridge")
    bench.ok("RotateRight")
    far = bench.object(fridge)["distance"]
    moves = ("MoveAhead", "MoveBack", "MoveLeft", "MoveRight")
    refused = [
        bench.step(move, fridge, maxAgentsDistance=far / 2)["errorMessage"] for move in moves
    ]
    assert all("beyond the max distance" in message for message in refused)
