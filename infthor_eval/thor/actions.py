"""Conversion between action texts and calls of AI2-THOR's 5.x API.

Models read and write texts: `MoveAhead`, `PickupObject Mug`, `PutObject Mug Fridge`. Their arguments are object types,
whereas calls have object ids. A text is grounded to the nearest visible object of the type to which the action applies.
"""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from infthor_eval.thor.view import SimulatorView, ThorObject

__all__ = [
    "ActionText",
    "Misuse",
    "UngroundedError",
    "applicable_actions",
    "applicable_calls",
    "ground",
    "object_type_of",
    "parse_action",
    "text_of",
    "text_of_call",
]

_APPLIES: dict[str, Callable[[ThorObject], bool]] = {
    "OpenObject": lambda item: item.openable and not item.is_open,
    "CloseObject": lambda item: item.openable and item.is_open,
    "PickupObject": lambda item: item.pickupable and not item.is_picked_up,
    "PutObject": lambda item: item.receptacle and not item.is_picked_up,
    "ToggleObjectOn": lambda item: item.toggleable and not item.is_toggled,
    "ToggleObjectOff": lambda item: item.toggleable and item.is_toggled,
    "SliceObject": lambda item: item.sliceable and not item.is_sliced,
}
_PLAIN = {"RotateLeft", "RotateRight", "MoveAhead", "LookUp", "LookDown", "NoOp"}
_LOOK_DEGREES = 30.0


class Misuse(StrEnum):
    """Why a text cannot be turned into a call."""

    NO_ACTION = "no action"
    UNKNOWN_OBJECT = "unknown object"
    NOT_IN_VIEW = "not in view"
    NOT_POSSIBLE = "not possible"


class UngroundedError(ValueError):
    """A text has no known action, lacks an argument, or matches no visible object; the message says which."""

    def __init__(self, misuse: Misuse, message: str) -> None:
        super().__init__(message)
        self.misuse = misuse


@dataclass(frozen=True)
class ActionText:
    """A low-level action in words: its name and its object types."""

    action: str
    types: tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.action, *self.types))


def parse_action(text: str) -> ActionText:
    """Parse an action text; names are case-sensitive, and any white space separates them.

    Raises:
        UngroundedError: the action is unknown, or has a wrong number of object types.
    """
    words = text.split()
    if not words:
        raise UngroundedError(Misuse.NO_ACTION, "empty action")
    action, *types = words
    if action not in _APPLIES and action not in _PLAIN:
        raise UngroundedError(Misuse.NO_ACTION, f"unknown action '{action}'")
    n_types = 0 if action in _PLAIN else 2 if action == "PutObject" else 1
    if len(types) != n_types:
        raise UngroundedError(Misuse.NO_ACTION, f"{action} takes {n_types} object types, got {len(types)}")
    return ActionText(action, tuple(types))


def text_of(action: str, object_id: str | None = None, receptacle_id: str | None = None) -> ActionText:
    """Return the text of a call; the object of PutObject is the one that is put into the receptacle."""
    ids = [item for item in (object_id, receptacle_id) if item is not None]
    return ActionText(action, tuple(object_type_of(item) for item in ids))


def ground(
    text: ActionText, view: SimulatorView, degrees: float = _LOOK_DEGREES, preferred: Container[str] = ()
) -> dict[str, Any]:
    """Turn an action text into a call.

    Args:
        degrees: angle by which LookUp and LookDown turn the camera.
        preferred: ids of objects that take precedence over nearer ones of their type.

    Returns:
        `{"action": ..., arguments}` for `Simulator.step(**call)`.

    Raises:
        UngroundedError: there is no visible object of the type to which the action applies.
    """
    if text.action == "NoOp":
        return {"action": "Pass"}
    if text.action in {"LookUp", "LookDown"}:
        return {"action": text.action, "degrees": degrees}
    if text.action in _PLAIN:
        return {"action": text.action}
    known = {item.object_type for item in view.objects.values()}
    for name in text.types:
        if name not in known:
            raise UngroundedError(Misuse.UNKNOWN_OBJECT, f"{text}: {name}: none in this scene")
    if text.action == "PutObject" and text.types[0] not in map(object_type_of, view.inventory):
        raise UngroundedError(Misuse.NOT_POSSIBLE, f"{text}: no {text.types[0]} in the hand")
    return {"action": text.action, "objectId": _choose_object(text, view, preferred).object_id}


def applicable_actions(view: SimulatorView) -> list[ActionText]:
    """Return all action texts that can be grounded now, in a fixed order."""
    return list(dict.fromkeys(text_of_call(call, view) for call in applicable_calls(view)))


def applicable_calls(view: SimulatorView, degrees: float = _LOOK_DEGREES) -> list[dict[str, Any]]:
    """Return all calls possible now, in a fixed order: each action with each visible object, looks by `degrees`."""
    calls = [ground(ActionText(name), view, degrees) for name in sorted(_PLAIN)]
    visible = sorted((item.object_type, item.object_id) for item in view.objects.values() if item.visible)
    for action, applies in _APPLIES.items():
        if action == "PutObject" and not view.inventory:
            continue
        ids = [key for _, key in visible if applies(view.objects[key])]
        calls += [{"action": action, "objectId": key} for key in ids]
    return calls


def text_of_call(call: Mapping[str, Any], view: SimulatorView) -> ActionText:
    """Return the text of a call in a state; the object of PutObject is the held one."""
    if call["action"] == "Pass":
        return ActionText("NoOp")
    key = call.get("objectId")
    if call["action"] == "PutObject" and view.inventory:
        return text_of("PutObject", view.inventory[0], key)
    return text_of(call["action"], key)


def object_type_of(object_id: str) -> str:
    """Return the object type in an object id.

    Ids are "Type|x|y|z". Parts have the type of the part at the end ("Sink|...|SinkBasin"), slices also a number after
    an underscore ("Apple|...|AppleSliced_2").
    """
    parts = object_id.split("|")
    return parts[4].split("_")[0] if len(parts) > 4 else parts[0]


def _choose_object(text: ActionText, view: SimulatorView, preferred: Container[str]) -> ThorObject:
    object_type, applies = text.types[-1], _APPLIES[text.action]
    visible = [item for item in view.objects.values() if item.object_type == object_type and item.visible]
    possible = [item for item in visible if applies(item)]
    if not visible:
        raise UngroundedError(Misuse.NOT_IN_VIEW, f"{text}: {object_type}: none in sight")
    if not possible:
        raise UngroundedError(Misuse.NOT_POSSIBLE, f"{text}: {object_type}: none of those in sight allows it")
    return min(possible, key=lambda item: (item.object_id not in preferred, item.distance, item.object_id))
