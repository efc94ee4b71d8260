"""Restoring a scene where physics moves what is placed, as in Unity.

As the published generator replays since July 2026 (`TrajManager` in `gen/utils/gen_util.py`):
recorded poses are those of settled objects, so setting them again after physics acted converges.
Then what cannot be picked up, and was pushed, is put back, and the hand gets what it should hold.

The embedded simulator has no such physics and needs none of this.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from msgspec.structs import asdict, astuple

from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

_ROUNDS = 2  # times that physics acts on the poses before they are set for the last time
_PASSES = 3  # actions of doing nothing in which physics acts
_PUSHED = 0.05  # metres from its place at which an object is put back
_TOLERANCE = 0.02  # metres; what is farther from its pose in the end is reported


class Deviation(NamedTuple):
    """The object that is farthest from its recorded pose, and how far, metres."""

    name: str
    metres: float


def poses_call(poses: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the call that gives objects their poses, by name."""
    return {"action": "SetObjectPoses", "objectPoses": poses, "placeStationary": True}


def settle(
    simulator: Simulator, poses: Sequence[dict[str, Any]], reference: SimulatorView
) -> tuple[list[str], Deviation | None]:
    """Give objects their poses until they stay there, and the rest its place of a reference state.

    Args:
        simulator: simulator with the scene, the agent at its place.
        poses: entries of `SetObjectPoses`, with names of the scene.
        reference: state with the places of objects that cannot be picked up, and what is held.

    Returns:
        The refused calls with the simulator's messages, and what is off by more than 2 cm.

    Raises:
        SimulatorError: the simulator fails.
    """
    refused: list[str] = []

    def run(call: dict[str, Any]) -> None:
        view = simulator.step(**call)
        if not view.success:
            refused.append(f"{call['action']}: {view.error}")

    held = simulator.view.inventory
    if held and held != reference.inventory:
        run({"action": "DropHeldObject", "forceAction": True})
    for _ in range(_ROUNDS):
        run(poses_call(poses))
        for _ in range(_PASSES):
            run({"action": "Pass"})
    run(poses_call(poses))
    for call in list(_calls_back(simulator.view, reference)):
        run(call)
    deviation = _deviation(poses, simulator.view)  # before anything is taken from its place
    for key in reference.inventory:
        if key not in simulator.view.inventory:
            run({"action": "PickupObject", "objectId": key, "forceAction": True})
    return refused, deviation


def _calls_back(current: SimulatorView, reference: SimulatorView) -> Iterator[dict[str, Any]]:
    for key, obj in current.objects.items():
        place = reference.objects.get(key)
        if place is None or place.pickupable or place.is_picked_up:
            continue
        if math.dist(astuple(place.position), astuple(obj.position)) > _PUSHED:
            yield {
                "action": "TeleportObject",
                "objectId": key,
                "position": asdict(place.position),
                "rotation": asdict(place.rotation),
                # its own resting place overlaps what it rests on, and would be refused
                "forceAction": True,
            }


def _deviation(poses: Sequence[dict[str, Any]], view: SimulatorView) -> Deviation | None:
    loose = [obj for obj in view.objects.values() if obj.pickupable]
    deviations = [
        Deviation(pose["objectName"], min(_distances(pose, loose), default=0.0)) for pose in poses
    ]
    worst = max(deviations, key=lambda found: found.metres, default=None)
    return worst if worst is not None and worst.metres > _TOLERANCE else None


def _distances(pose: dict[str, Any], loose: Sequence[ThorObject]) -> Iterator[float]:
    """Yield the distances of all objects with a pose's name: several may have it."""
    place = [pose["position"][axis] for axis in "xyz"]
    for obj in loose:
        if obj.name.removesuffix("(Clone)") == pose["objectName"]:
            yield math.dist(astuple(obj.position), place)
