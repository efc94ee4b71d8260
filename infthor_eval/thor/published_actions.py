"""From an agent's text to a call, by the published `interact_with_env`, `post_processing_action`.

A name is sought as a part of the objects' names, case apart, and the first visible object that has
the property is taken, whatever its state. What cannot be grounded is sent nevertheless: without an
id, or as an action of that name. Where the metadata of an object that is looked at lack the
property, the script drops the action with the error.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from msgspec import UNSET, UnsetType

from infthor_eval.thor.actions import Misuse, UngroundedError
from infthor_eval.thor.view import SimulatorView, ThorObject

_Has = Callable[[ThorObject], bool | UnsetType]

_HAS: Mapping[str, _Has] = {
    "OpenObject": lambda obj: obj.openable,
    "CloseObject": lambda obj: obj.is_open,
    "PickupObject": lambda obj: obj.pickupable,
    "SliceObject": lambda obj: obj.sliceable,
}
_WITHOUT_OBJECT = {
    *("MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight"),
    *("LookUp", "LookDown", "Crouch", "Stand", "Pass", "NoOp", "Done"),
}
_PUT = "PutObject"
_TOGGLE = "ToggleObject"


def ground_published(text: str, objects: Iterable[ThorObject]) -> tuple[str | None, str | None]:
    """Return the action and object id of a text with "Object" in it; None where there is none.

    Args:
        text: what the agent said.
        objects: all objects, in the order of the metadata.
    """
    try:
        if text.startswith(_PUT):
            return _PUT, _first(objects, _last_word(text), lambda obj: obj.receptacle)
        if text.startswith(_TOGGLE):  # on and off alike
            return _TOGGLE, _first(objects, _last_word(text), lambda obj: obj.toggleable)
        for action, has in _HAS.items():
            if text.startswith(action):
                return action, _first(objects, text.rsplit(action, maxsplit=1)[-1].strip(), has)
    except _UnreportedError:
        pass
    return None, None


def published_call(text: str, objects: Iterable[ThorObject], held: str | None) -> dict[str, Any]:
    """Return the call that the published script sends for a text, in AI2-THOR 2.1.0's form.

    Args:
        held: id of the held object; None if there is none.

    Raises:
        LookupError: an object is to be put, and none is held; the script then sends nothing.
    """
    if "Object" not in text:
        return {"action": text, "forceAction": True}
    action, object_id = ground_published(text, objects)
    if _PUT in text and object_id is not None:
        if held is None:
            raise LookupError("nothing is held")
        ids = {"objectId": held, "receptacleObjectId": object_id}
        return {"action": _PUT, **ids, "forceAction": True, "placeStationary": True}
    ids = {} if object_id is None else {"objectId": object_id}
    return {"action": action, **ids, "forceAction": True}


def _last_word(text: str) -> str:
    return text.rsplit(maxsplit=1)[-1]


class _UnreportedError(LookupError):
    """The metadata of an object lack a property."""


def _first(objects: Iterable[ThorObject], name: str, has: _Has) -> str | None:
    """Return the id of the first visible object with this text in its name that has a property."""
    wanted = name.lower()
    for obj in objects:
        if wanted in obj.name.lower() and obj.visible:
            value = has(obj)
            if value is UNSET:
                raise _UnreportedError(obj.object_id)
            if value:
                return obj.object_id
    return None


def current_call(text: str, view: SimulatorView) -> dict[str, Any]:
    """Return the published call for a text in the form of AI2-THOR 5.x.

    A text that is no action of an agent is not sent: the published script would send it as a
    command to the simulator, which refuses what it does not know, and would also take `Reset` from
    an agent.

    Raises:
        UngroundedError: there is nothing to send.
    """
    try:
        call = published_call(text, view.objects.values(), next(iter(view.inventory), None))
    except LookupError as error:
        raise UngroundedError(Misuse.NOT_POSSIBLE, f"{text}: {error}") from error
    if call["action"] is None or ("Object" not in text and text not in _WITHOUT_OBJECT):
        raise UngroundedError(Misuse.NO_ACTION, f"unknown action '{text}'")
    if text == "NoOp":
        call["action"] = "Pass"
    receptacle = call.pop("receptacleObjectId", None)
    return call if receptacle is None else {**call, "objectId": receptacle}
