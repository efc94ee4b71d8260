"""What the words of a plan ask for, done without looking: each kind of plan has its few actions."""

import re
from collections.abc import Sequence

from infthor_eval.household.affordances import KNOWN_TYPES
from infthor_eval.household.wording import compact_name

__all__ = ["about", "read_plan", "scripted"]

_TYPES = {compact_name(name): name for name in sorted(KNOWN_TYPES)}
_TYPES |= {"sink": "SinkBasin", "bathtub": "BathtubBasin"}  # things are put into the basin
_CLOSED = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "Laptop", "Microwave", "Safe"})  # at first, as a rule
_VERBS = ("go to", "open", "close", "pick up", "put", "wash", "heat", "cool", "toggle", "slice")
_PLAN = re.compile(rf"({'|'.join(_VERBS)}) (?:the )?(\S+)(?: in the (\S+))?")


def read_plan(plan: str) -> tuple[str, tuple[str, ...]]:
    """The verb of a plan and the object types that it names; a word that is no known type stays as it is.

    Args:
        plan: its text ("put the mug in the fridge").

    Returns:
        ("put", ("Mug", "Fridge")); the whole text and nothing where it is not of the usual form.
    """
    found = _PLAN.fullmatch(plan)
    if found is None:
        return plan, ()
    verb, *words = found.groups()
    return verb, tuple(_TYPES.get(word, word) for word in words if word is not None)


def about(plan: str, types: Sequence[str]) -> str:
    """The same plan about other objects.

    Args:
        plan: its text, of the usual form.
        types: for the objects that it names, in their order.
    """
    found = _PLAN.fullmatch(plan)
    assert found is not None
    for group, name in reversed([*enumerate(types, start=2)]):
        start, end = found.span(group)
        plan = plan[:start] + compact_name(name) + plan[end:]
    return plan


def scripted(plan: str, done: Sequence[str]) -> str:
    """The next action.

    Args:
        plan: its text.
        done: the actions so far.
    """
    actions = _actions(*read_plan(plan))
    return actions[min(len(done), len(actions) - 1)]


def _actions(verb: str, types: tuple[str, ...]) -> list[str]:
    """The whole script; its last action is said again where more are asked for."""
    item, receptacle = (*types, "", "")[:2]
    scripts = {
        "open": [f"OpenObject {item}"],
        "close": [f"CloseObject {item}"],
        "slice": [f"SliceObject {item}"],
        "pick up": [f"PickupObject {item}"],
        "toggle": [f"ToggleObjectOn {item}"],
        "put": _inside(receptacle, f"PutObject {item} {receptacle}"),
        "wash": _treated(item, "SinkBasin", ["ToggleObjectOn Faucet", "ToggleObjectOff Faucet"]),
        "heat": _treated(item, "Microwave", ["ToggleObjectOn Microwave", "ToggleObjectOff Microwave"]),
        "cool": _treated(item, "Fridge", []),
    }
    return scripts.get(verb, ["MoveAhead"])


def _treated(item: str, appliance: str, treatment: list[str]) -> list[str]:
    put, take = f"PutObject {item} {appliance}", f"PickupObject {item}"
    return [*_inside(appliance, put), *treatment, *_inside(appliance, take)]


def _inside(receptacle: str, action: str) -> list[str]:
    """The action with the receptacle opened before and closed behind it, where such a one is closed at first."""
    if receptacle not in _CLOSED:
        return [action]
    return [f"OpenObject {receptacle}", action, f"CloseObject {receptacle}"]
