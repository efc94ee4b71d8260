"""Bringing a simulator to where another one is in the same scene, by calls that every back end and agent mode knows.

An expert acts with AI2-THOR's default agent, an arm in a simulator of the arm's mode. Both begin with the same restored
scene, so their objects have the same ids; what was opened, switched, cut, dirtied and moved since then is done again.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView, ThorObject, Vector

__all__ = ["transfer"]

_NEAR = 0.01  # metres within which an object is where it should be
_ALIKE = 0.5  # degrees within which it is turned as it should be
_ROUNDS = 3  # of putting things where they should be: what stands in another moves with it


class _State(NamedTuple):
    """A state that can be set either way: how to read it, and the calls that make it so, and not so."""

    read: Callable[[ThorObject], Any]
    on: dict[str, Any]
    off: dict[str, Any]


_STATES = (
    _State(lambda item: item.is_broken, {"action": "BreakObject"}, {}),
    _State(lambda item: item.is_toggled, {"action": "ToggleObjectOn"}, {"action": "ToggleObjectOff"}),
    _State(lambda item: item.is_dirty, {"action": "DirtyObject"}, {"action": "CleanObject"}),
    _State(lambda item: item.is_cooked, {"action": "CookObject"}, {}),
    _State(
        lambda item: item.is_filled_with_liquid,
        {"action": "FillObjectWithLiquid", "fillLiquid": "water"},
        {"action": "EmptyLiquidFromObject"},
    ),
)


def transfer(simulator: Simulator, wanted: SimulatorView) -> list[str]:
    """Make the objects' states and poses those of another view; the agent stays where it is.

    What a hand holds there floats here where the hand holds it.

    Args:
        simulator: in the same scene, from the same initial state on.
        wanted: the view.

    Returns:
        Ids of the objects that are missing or lie elsewhere nevertheless, sorted.

    Raises:
        SimulatorError: the simulator fails.
    """
    for key in _cut(simulator.view, wanted):  # first: slices are objects of their own, and can be moved then
        simulator.step("SliceObject", objectId=key, forceAction=True)
    for call in _doors(simulator.view, wanted):
        simulator.step(**call)
    for state in _STATES:
        _set(simulator, wanted, state)
    for _ in range(_ROUNDS):
        moves = list(_moves(simulator.view, wanted))
        if not moves:
            break
        for call in moves:
            simulator.step(**call)
    return sorted(_misplaced(simulator.view, wanted))


def _cut(here: SimulatorView, wanted: SimulatorView) -> list[str]:
    """What is in slices there; the embedded simulator no longer tells of the whole thing then."""
    parts = {key.rpartition("|")[0] for key in wanted.objects.keys() - here.objects.keys()}
    return [key for key, item in here.objects.items() if key in parts and item.sliceable and not item.is_sliced]


def _set(simulator: Simulator, wanted: SimulatorView, state: _State) -> None:
    for key, there in wanted.objects.items():
        here = simulator.view.objects.get(key)
        call = state.on if state.read(there) else state.off
        if here is not None and call and state.read(here) != state.read(there):
            simulator.step(**call, objectId=key, forceAction=True)


def _doors(here: SimulatorView, wanted: SimulatorView) -> Iterator[dict[str, Any]]:
    """What was opened and closed; a thing that runs is switched off before, and on again by its state."""
    for key, there in wanted.objects.items():
        item = here.objects.get(key)
        if item is None or not there.openable or item.openness == there.openness:
            continue
        if item.is_toggled and there.is_open:
            yield {"action": "ToggleObjectOff", "objectId": key, "forceAction": True}
        if item.is_open:  # how far open it is can be changed from closed alone
            yield {"action": "CloseObject", "objectId": key, "forceAction": True}
        if there.is_open:
            yield {"action": "OpenObject", "objectId": key, "openness": there.openness, "forceAction": True}


def _moves(here: SimulatorView, wanted: SimulatorView) -> Iterator[dict[str, Any]]:
    """What lies elsewhere or otherwise; receptacles before what is in them."""
    for key, there in sorted(wanted.objects.items(), key=lambda pair: not pair[1].receptacle):
        item = here.objects.get(key)
        if item is None or not there.pickupable or (_is_at(item, there) and _is_turned(item, there)):
            continue
        yield {
            "action": "TeleportObject",
            "objectId": key,
            "position": _xyz(there.position),
            "rotation": _xyz(there.rotation),
            "forceAction": True,
            "forceKinematic": True,
        }


def _misplaced(here: SimulatorView, wanted: SimulatorView) -> Iterator[str]:
    for key, there in wanted.objects.items():
        item = here.objects.get(key)
        if item is None or (there.pickupable and not _is_at(item, there)):
            yield key


def _is_at(item: ThorObject, there: ThorObject) -> bool:
    return math.dist(_tuple(item.position), _tuple(there.position)) <= _NEAR


def _is_turned(item: ThorObject, there: ThorObject) -> bool:
    turns = zip(_tuple(item.rotation), _tuple(there.rotation), strict=True)
    return all(abs((a - b + 180.0) % 360.0 - 180.0) <= _ALIKE for a, b in turns)


def _tuple(vector: Vector) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _xyz(vector: Vector) -> dict[str, float]:
    return {"x": vector.x, "y": vector.y, "z": vector.z}
