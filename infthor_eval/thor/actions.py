"""Conversion between action texts and calls of AI2-THOR's 5.x API.

Models read and write texts: `MoveAhead`, `PickupObject Mug`, `PutObject Mug Fridge`. Their
arguments are names of objects (`Words`), whereas calls have object ids. A text is grounded to the
nearest visible object of the name to which the action applies; how the published scripts ground it
is in `plans/published/script.py`.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from msgspec import UnsetType

from infthor_eval.formats.object_ids import Words
from infthor_eval.thor.view import SimulatorView, ThorObject

_APPLIES: dict[str, Callable[[ThorObject], bool | UnsetType]] = {
    "OpenObject": lambda obj: obj.openable and not obj.is_open,
    "CloseObject": lambda obj: obj.openable and obj.is_open,
    "PickupObject": lambda obj: obj.pickupable and not obj.is_picked_up,
    "PutObject": lambda obj: obj.receptacle and not obj.is_picked_up,
    "ToggleObjectOn": lambda obj: obj.toggleable and not obj.is_toggled,
    "ToggleObjectOff": lambda obj: obj.toggleable and obj.is_toggled,
    "SliceObject": lambda obj: obj.sliceable and not obj.is_sliced,
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
    """A text without a known action, an argument or a visible object; the message says which."""

    def __init__(self, misuse: Misuse, message: str) -> None:
        super().__init__(message)
        self.misuse = misuse


@dataclass(frozen=True)
class ActionText:
    """A low-level action in words: its name and its objects' names."""

    action: str
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.action, *self.names))


def parse_action(text: str) -> ActionText:
    """Parse an action text; names are case-sensitive, and any white space separates them.

    Raises:
        UngroundedError: the action is unknown, or has a wrong number of objects.
    """
    words = text.split()
    if not words:
        raise UngroundedError(Misuse.NO_ACTION, "empty action")
    action, *names = words
    if action not in _APPLIES and action not in _PLAIN:
        raise UngroundedError(Misuse.NO_ACTION, f"unknown action '{action}'")
    n_names = 0 if action in _PLAIN else 2 if action == "PutObject" else 1
    if len(names) != n_names:
        raise UngroundedError(
            Misuse.NO_ACTION, f"{action} takes {n_names} object types, got {len(names)}"
        )
    return ActionText(action, tuple(names))


def text_of(
    action: str,
    object_id: str | None = None,
    receptacle_id: str | None = None,
    words: Words = Words.NATURAL,
) -> ActionText:
    """Return the text of a call; PutObject's object is the one put into the receptacle."""
    ids = [key for key in (object_id, receptacle_id) if key is not None]
    return ActionText(action, tuple(words.name_of(key) for key in ids))


def ground(
    text: ActionText,
    view: SimulatorView,
    degrees: float = _LOOK_DEGREES,
    preferred: Container[str] = (),
    words: Words = Words.NATURAL,
) -> dict[str, Any]:
    """Turn an action text into a call.

    Args:
        degrees: angle by which LookUp and LookDown turn the camera.
        preferred: ids of objects that take precedence over nearer ones of their name.
        words: words that the text may use; object types are understood in any case.

    Returns:
        `{"action": ..., arguments}` for `Simulator.step(**call)`.

    Raises:
        UngroundedError: there is no visible object of the name to which the action applies.
    """
    if text.action == "NoOp":
        return {"action": "Pass"}
    if text.action in {"LookUp", "LookDown"}:
        return {"action": text.action, "degrees": degrees}
    if text.action in _PLAIN:
        return {"action": text.action}
    named = {key: _names_of(obj, words) for key, obj in view.objects.items()}
    known = set[str]().union(*named.values())
    for name in text.names:
        if name not in known:
            raise UngroundedError(Misuse.UNKNOWN_OBJECT, f"{text}: {name}: none in this scene")
    if text.action == "PutObject" and not any(
        text.names[0] in named.get(key, ()) for key in view.inventory
    ):
        raise UngroundedError(Misuse.NOT_POSSIBLE, f"{text}: no {text.names[0]} in the hand")
    meant = [obj for key, obj in view.objects.items() if text.names[-1] in named[key]]
    return {"action": text.action, "objectId": _choose_object(text, meant, preferred).object_id}


def applicable_actions(view: SimulatorView, words: Words = Words.NATURAL) -> list[ActionText]:
    """Return all action texts that can be grounded now, in a fixed order."""
    return list(dict.fromkeys(text_of_call(call, view, words) for call in applicable_calls(view)))


def applicable_calls(view: SimulatorView, degrees: float = _LOOK_DEGREES) -> list[dict[str, Any]]:
    """Return all calls possible now, in a fixed order: each action with each visible object, looks
    by `degrees`."""
    calls = [ground(ActionText(name), view, degrees) for name in sorted(_PLAIN)]
    visible = sorted(
        (obj.object_type, obj.object_id) for obj in view.objects.values() if obj.visible
    )
    for action, applies in _APPLIES.items():
        if action == "PutObject" and not view.inventory:
            continue
        ids = [key for _, key in visible if applies(view.objects[key])]
        calls += [{"action": action, "objectId": key} for key in ids]
    return calls


def text_of_call(
    call: Mapping[str, Any], view: SimulatorView, words: Words = Words.NATURAL
) -> ActionText:
    """Return the text of a call in a state; the object of PutObject is the held one."""
    if call["action"] == "Pass":
        return ActionText("NoOp")
    key = call.get("objectId")
    if call["action"] == "PutObject" and view.inventory:
        return text_of("PutObject", view.inventory[0], key, words)
    return text_of(call["action"], key, words=words)


def _names_of(obj: ThorObject, words: Words) -> set[str]:
    """Return the names by which an agent may call an object: in these words, and its type."""
    return {words.name_of(obj.object_id), obj.object_type}


def _choose_object(
    text: ActionText, meant: Sequence[ThorObject], preferred: Container[str]
) -> ThorObject:
    """Return the object of a text among those that its last name can mean."""
    name = text.names[-1]
    applies = _APPLIES[text.action]
    visible = [obj for obj in meant if obj.visible]
    possible = [obj for obj in visible if applies(obj)]
    if not visible:
        raise UngroundedError(Misuse.NOT_IN_VIEW, f"{text}: {name}: none in sight")
    if not possible:
        raise UngroundedError(
            Misuse.NOT_POSSIBLE, f"{text}: {name}: none of those in sight allows it"
        )
    return min(
        possible, key=lambda obj: (obj.object_id not in preferred, obj.distance, obj.object_id)
    )
