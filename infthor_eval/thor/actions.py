"""Action text and calls of AI2-THOR's 5.x API, both ways.

Text is what models read and write: `MoveAhead`, `PickupObject Mug`, `PutObject Mug Fridge`. Its arguments are
object types; a call names objects by id. A text is grounded to the nearest visible object of that type which
the action applies to.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from infthor_eval.thor.view import ThorObject, View

__all__ = ["ActionText", "UngroundedError", "ground", "object_type_of", "parse_action", "text_of"]

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


class UngroundedError(ValueError):
    """A text names no known action, lacks an argument, or fits no object in sight; the message says which."""


@dataclass(frozen=True)
class ActionText:
    """A low-level action in words: its name and the object types it is about."""

    action: str
    types: tuple[str, ...] = ()

    def __str__(self) -> str:
        return " ".join((self.action, *self.types))


def parse_action(text: str) -> ActionText:
    """Read an action text; white space does not matter, the case of the names does.

    Raises:
        UngroundedError: an unknown action, or not as many object types as it takes.
    """
    words = text.split()
    if not words:
        raise UngroundedError("empty action")
    action, *types = words
    if action not in _APPLIES and action not in _PLAIN:
        raise UngroundedError(f"unknown action '{action}'")
    wanted = 0 if action in _PLAIN else 2 if action == "PutObject" else 1
    if len(types) != wanted:
        raise UngroundedError(f"{action} takes {wanted} object types, got {len(types)}")
    return ActionText(action, tuple(types))


def text_of(action: str, object_id: str | None = None, receptacle_id: str | None = None) -> ActionText:
    """The text of a call.

    Args:
        action: its name.
        object_id: the object acted on; for PutObject the object put.
        receptacle_id: for PutObject where it is put.
    """
    ids = [item for item in (object_id, receptacle_id) if item is not None]
    return ActionText(action, tuple(object_type_of(item) for item in ids))


def ground(text: ActionText, view: View, degrees: float = _LOOK_DEGREES) -> dict[str, Any]:
    """Turn an action text into a call.

    Args:
        text: the action.
        view: what the agent sees now.
        degrees: by which LookUp and LookDown turn the camera.

    Returns:
        `{"action": ..., arguments}` as `Simulator.step(**call)` takes it.

    Raises:
        UngroundedError: no visible object of that type to which the action applies.
    """
    if text.action == "NoOp":
        return {"action": "Pass"}
    if text.action in {"LookUp", "LookDown"}:
        return {"action": text.action, "degrees": degrees}
    if text.action in _PLAIN:
        return {"action": text.action}
    if text.action == "PutObject" and text.types[0] not in map(object_type_of, view.inventory):
        raise UngroundedError(f"{text}: no {text.types[0]} in the hand")
    return {"action": text.action, "objectId": _nearest(text, view).object_id}


def object_type_of(object_id: str) -> str:
    """The type that an object id names.

    Ids are "Type|x|y|z", with the part's type at the end for parts ("Sink|...|SinkBasin") and its number
    after an underscore for slices ("Apple|...|AppleSliced_2").
    """
    parts = object_id.split("|")
    return parts[4].split("_")[0] if len(parts) > 4 else parts[0]


def _nearest(text: ActionText, view: View) -> ThorObject:
    object_type, applies = text.types[-1], _APPLIES[text.action]
    fitting = [item for item in view.objects.values() if item.object_type == object_type and item.visible]
    able = [item for item in fitting if applies(item)]
    if not able:
        why = "none of those in sight allows it" if fitting else "none in sight"
        raise UngroundedError(f"{text}: {object_type}: {why}")
    return min(able, key=lambda item: (item.distance, item.object_id))
