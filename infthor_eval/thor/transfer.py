"""Copying the object states of one simulator to another in the same scene.

Experts act with AI2-THOR's default agent, arms in a simulator of the arm's agent mode. Both start
from the same restored scene, so their objects have the same ids. What was opened, switched, sliced,
dirtied and moved since then is repeated by calls that every back end and agent mode supports.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from msgspec.structs import asdict, astuple

from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject

_NEAR = 0.01  # tolerance of positions, metres
_ALIKE = 0.5  # tolerance of rotations, degrees
_ROUNDS = 3  # passes over all objects: moving a receptacle also moves what is in it


class _State(NamedTuple):
    """A state of objects; the calls `on` and `off` set and unset it, empty if no call does."""

    read: Callable[[ThorObject], Any]
    on: dict[str, Any]
    off: dict[str, Any]


_STATES = (
    _State(lambda obj: obj.is_broken, {"action": "BreakObject"}, {}),
    _State(lambda obj: obj.is_toggled, {"action": "ToggleObjectOn"}, {"action": "ToggleObjectOff"}),
    _State(lambda obj: obj.is_dirty, {"action": "DirtyObject"}, {"action": "CleanObject"}),
    _State(lambda obj: obj.is_cooked, {"action": "CookObject"}, {}),
    _State(
        lambda obj: obj.is_filled_with_liquid,
        {"action": "FillObjectWithLiquid", "fillLiquid": "water"},
        {"action": "EmptyLiquidFromObject"},
    ),
)


def transfer(simulator: Simulator, target: SimulatorView) -> list[str]:
    """Give all objects their states and poses in another simulator; the agent stays where it is.

    An object held by the other agent floats where that agent holds it.

    Returns:
        Sorted ids of the objects that are missing, or could not be moved to their position.
    """
    # First, so that the slices exist when objects are moved.
    for key in _objects_to_slice(simulator.view, target):
        simulator.step("SliceObject", objectId=key, forceAction=True)
    for call in _door_calls(simulator.view, target):
        simulator.step(**call)
    for state in _STATES:
        _set_state(simulator, target, state)
    for _ in range(_ROUNDS):
        calls = list(_move_calls(simulator.view, target))
        if not calls:
            break
        for call in calls:
            simulator.step(**call)
    return sorted(_misplaced_objects(simulator.view, target))


def _objects_to_slice(current: SimulatorView, target: SimulatorView) -> list[str]:
    # By the ids of new slices: the embedded simulator no longer reports the sliced object itself.
    sliced = {key.rpartition("|")[0] for key in target.objects.keys() - current.objects.keys()}
    return [
        key
        for key, obj in current.objects.items()
        if key in sliced and obj.sliceable and not obj.is_sliced
    ]


def _set_state(simulator: Simulator, target: SimulatorView, state: _State) -> None:
    for key, goal in target.objects.items():
        obj = simulator.view.objects.get(key)
        call = state.on if state.read(goal) else state.off
        if obj is not None and call and state.read(obj) != state.read(goal):
            simulator.step(**call, objectId=key, forceAction=True)


def _door_calls(current: SimulatorView, target: SimulatorView) -> Iterator[dict[str, Any]]:
    for key, goal in target.objects.items():
        obj = current.objects.get(key)
        if obj is None or not goal.openable or obj.openness == goal.openness:
            continue
        # A running appliance cannot be opened; `_STATES` switches it on again.
        if obj.is_toggled and goal.is_open:
            yield {"action": "ToggleObjectOff", "objectId": key, "forceAction": True}
        if obj.is_open:  # AI2-THOR changes `openness` only of closed objects
            yield {"action": "CloseObject", "objectId": key, "forceAction": True}
        if goal.is_open:
            yield {
                "action": "OpenObject",
                "objectId": key,
                "openness": goal.openness,
                "forceAction": True,
            }


def _move_calls(current: SimulatorView, target: SimulatorView) -> Iterator[dict[str, Any]]:
    # Receptacles before their contents, which move along with them.
    for key, goal in sorted(target.objects.items(), key=lambda pair: not pair[1].receptacle):
        obj = current.objects.get(key)
        if obj is None or not goal.pickupable or (_is_at(obj, goal) and _is_turned_like(obj, goal)):
            continue
        yield {
            "action": "TeleportObject",
            "objectId": key,
            "position": asdict(goal.position),
            "rotation": asdict(goal.rotation),
            "forceAction": True,
            "forceKinematic": True,
        }


def _misplaced_objects(current: SimulatorView, target: SimulatorView) -> Iterator[str]:
    for key, goal in target.objects.items():
        obj = current.objects.get(key)
        if obj is None or (goal.pickupable and not _is_at(obj, goal)):
            yield key


def _is_at(obj: ThorObject, goal: ThorObject) -> bool:
    return math.dist(astuple(obj.position), astuple(goal.position)) <= _NEAR


def _is_turned_like(obj: ThorObject, goal: ThorObject) -> bool:
    turns = zip(astuple(obj.rotation), astuple(goal.rotation), strict=True)
    return all(abs((a - b + 180.0) % 360.0 - 180.0) <= _ALIKE for a, b in turns)
