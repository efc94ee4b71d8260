# ruff: noqa: ARG001 - the wire's arguments are accepted even where nothing depends on them
"""Setting a scene to a recorded, random or saved state: poses, toggles, states, placement."""

import os
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from infthor_sim.actions.interaction import set_openness
from infthor_sim.actions.registry import action, is_vector
from infthor_sim.errors import ActionError, UsageError
from infthor_sim.geometry import to_array
from infthor_sim.object_types import OBJECT_TYPES
from infthor_sim.rearrange import NamedPose, ids_by_position, set_poses, spawn_randomly
from infthor_sim.simulation import Simulation

# Poses that SetObjectPoses takes; real scenes have up to 60. The variable raises the limit.
_MAX_POSES = 1000
_MAX_POSES_VARIABLE = "INFTHOR_EVAL_MAX_OBJECT_POSES"


@action("SetObjectPoses")
def set_object_poses(
    sim: Simulation,
    objectPoses: list[Any],
    placeStationary: bool = True,
    enablePhysicsJitter: bool = True,
    forceRigidbodySleep: bool = True,
    skipMoveable: bool = False,
) -> None:
    """Place the listed objects by name, copies of those listed twice; others that move vanish."""
    limit = _max_poses()
    if len(objectPoses) > limit:
        raise ActionError(
            f"objectPoses has {len(objectPoses):,} entries, too many for a scene; "
            f"if this is intended, set {_MAX_POSES_VARIABLE} to more than {limit}"
        )
    poses = [_named_pose(entry) for entry in objectPoses]
    unknown = set_poses(sim.world, poses, keep_moveable=skipMoveable) if poses else []
    if unknown:
        raise ActionError(
            f"No Pickupable or Moveable object of name {unknown[-1]:.60} found in scene."
        )


def _max_poses() -> int:
    text = os.environ.get(_MAX_POSES_VARIABLE)
    if text is None:
        return _MAX_POSES
    if not (text.isascii() and text.isdecimal() and len(text) <= 18 and int(text) > 0):
        raise UsageError(
            f"{_MAX_POSES_VARIABLE}={text[:40]}: not a whole number above 0; "
            "set it to one, or unset it"
        )
    return int(text)


def _named_pose(entry: Any) -> NamedPose:
    if not isinstance(entry, Mapping) or not isinstance(entry.get("objectName"), str):
        raise ActionError(
            f"objectPoses needs entries with objectName, position and rotation, not {entry!r}"
        )
    name = entry["objectName"]
    position = entry.get("position")
    rotation = entry.get("rotation") or {}
    if not is_vector(position) or not is_vector(rotation):
        raise ActionError(f"objectPoses: {name:.60} has no usable position or rotation")
    return NamedPose(name, to_array(position), to_array(rotation))


@action("SetObjectToggles")
def set_object_toggles(sim: Simulation, objectToggles: list[Any]) -> None:
    """Switch all objects of the listed types on or off."""
    switched: dict[str, bool] = {}
    for entry in objectToggles:
        if not isinstance(entry, Mapping) or not isinstance(entry.get("objectType"), str):
            raise ActionError(
                f"objectToggles needs entries with objectType and isOn, not {entry!r}"
            )
        _check_type(sim, entry["objectType"])
        switched[entry["objectType"]] = bool(entry.get("isOn", False))
    for item in sim.world.objects.values():
        if item.object_type in switched and item.type.toggleable:
            item.state.toggled = switched[item.object_type]
            sim.world.mark_changed(item)


def _check_type(sim: Simulation, name: Any) -> None:
    """Refuse what is no type of object; one that is not in the scene is none the less one."""
    if name not in [*OBJECT_TYPES, *(o.object_type for o in sim.world.objects.values())]:
        raise ActionError(f"{name!r:.60} is not an object type")


class _StateChange(NamedTuple):
    """A state that can be set on many objects at once.

    Attributes:
        ability: attribute of `ObjectType` that an object must have.
        flag: the metadata's name of the state.
        state: attribute of `SimObjectState`.
        on: its value where the flag is true.
        off: its value where the flag is false.
    """

    ability: str
    flag: str
    state: str
    on: Any = True
    off: Any = False


_CHANGES = {  # by `stateChange` of SetObjectStates
    "openable": _StateChange("openable", "isOpen", "openness", 1.0, 0.0),
    "toggleable": _StateChange("toggleable", "isToggled", "toggled"),
    "dirtyable": _StateChange("dirtyable", "isDirty", "dirty"),
    "breakable": _StateChange("breakable", "isBroken", "broken"),
    "canFillWithLiquid": _StateChange(
        "fillable", "isFilledWithLiquid", "fill_liquid", "water", None
    ),
    "canBeUsedUp": _StateChange("usable_up", "isUsedUp", "used_up"),
    "cookable": _StateChange("cookable", "isCooked", "cooked"),
}
_ALL_AT_ONCE = {  # by `StateChange` of SetStateOfAllObjects
    "CanBeDirty": _CHANGES["dirtyable"],
    "CanBeFilled": _CHANGES["canFillWithLiquid"],
    "CanBeUsedUp": _CHANGES["canBeUsedUp"],
}


@action("SetStateOfAllObjects")
def set_state_of_all_objects(sim: Simulation, StateChange: str, forceAction: bool = False) -> None:
    """Make every capable object dirty, filled or used up; without `forceAction` undo that."""
    change = _ALL_AT_ONCE.get(StateChange)
    if change is None:
        raise ActionError(
            f"{StateChange!r} is not a state change; use one of {', '.join(sorted(_ALL_AT_ONCE))}"
        )
    _change_all(sim, change, forceAction)


@action("SetObjectStates")
def set_object_states(sim: Simulation, SetObjectStates: Mapping[str, Any]) -> None:
    """Set one state of all objects of a type, or of all at once.

    `SetObjectStates` holds `objectType` (or none for all), `stateChange` and the new value under
    its own name (`isOpen`, `isToggled`, `isDirty`, `isBroken`, `isFilledWithLiquid`, `isUsedUp`,
    `isCooked`).
    """
    name = str(SetObjectStates.get("stateChange", ""))
    change = _CHANGES.get(name)
    if change is None:
        raise ActionError(
            f"{name!r} is not a stateChange; use one of {', '.join(sorted(_CHANGES))}"
        )
    only = SetObjectStates.get("objectType")
    if only:
        _check_type(sim, only)
    _change_all(sim, change, bool(SetObjectStates.get(change.flag, True)), only)


def _change_all(sim: Simulation, change: _StateChange, on: bool, only: str | None = None) -> None:
    """Change the state of every capable object, or of those of type `only`."""
    value = change.on if on else change.off
    for item in sim.world.objects.values():
        if not getattr(item.type, change.ability) or only not in (None, "", item.object_type):
            continue
        if change.state == "openness":  # which also moves contents and changes boxes
            set_openness(sim, item, value)
        else:
            setattr(item.state, change.state, value)
            sim.world.mark_changed(item)


@action("RemoveFromScene")
def remove_from_scene(sim: Simulation, objectId: str) -> None:
    """Take an object out of the scene."""
    sim.world.remove(sim.world.get(objectId))


@action("InitialRandomSpawn")
def initial_random_spawn(
    sim: Simulation,
    randomSeed: int = 0,
    forceVisible: bool = False,
    numPlacementAttempts: int = 5,
    placeStationary: bool = True,
    excludedReceptacles: list[str] | None = None,
    excludedObjectIds: list[str] | None = None,
    numDuplicatesOfType: list[Any] | None = None,
    allowFloor: bool = False,
    allowMoveable: bool = False,
) -> None:
    """Spread the pickupable objects over the receptacles, the same way for the same seed.

    Loose objects get ids by their new positions, moved or not, as AI2-THOR sets up its scene anew.
    SetRandomSeed has no part in it, as there.
    """
    if numPlacementAttempts <= 0:
        raise ActionError("numPlacementAttempts must be a positive integer.")
    for name in excludedReceptacles or ():
        _check_type(sim, name)
    for object_id in excludedObjectIds or ():
        sim.world.get(object_id)
    if numDuplicatesOfType:
        raise ActionError(
            "numDuplicatesOfType is not offered by the embedded simulator; use SetObjectPoses"
        )
    spawn_randomly(
        sim.world,
        _random_from_seed(randomSeed),
        excluded_types=frozenset(excludedReceptacles or ()),
        kept=frozenset(excludedObjectIds or ()),
        in_open_only=forceVisible,
    )
    new_ids = ids_by_position(sim.world)
    sim.world.rename(new_ids)
    if sim.object_filter is not None:  # which goes on to list the same objects
        sim.object_filter = frozenset(new_ids.get(old, old) for old in sim.object_filter)


@action("SetRandomSeed")
def set_random_seed(sim: Simulation, seed: int) -> None:
    """Restart the simulator's random numbers from a seed."""
    sim.random = _random_from_seed(seed)


def _random_from_seed(seed: int) -> np.random.Generator:
    return np.random.default_rng(int(seed) % 2**32)  # Unity's seeds are signed, numpy's are not


@action("SaveState", query=True)
def save_state(sim: Simulation, slot: int = 0) -> None:
    """Keep the present state in a slot, in place of an earlier one.

    Unity cannot: generation undoes failed subtasks with it, without a replay.
    """
    sim.save(slot)


@action("RestoreState")
def restore_state(sim: Simulation, slot: int = 0) -> None:
    """Bring back the state kept in a slot; it stays kept."""
    if not sim.restore(slot):
        raise ActionError("There is no saved state of this scene")
