"""What the words of a plan ask for, done without looking: each kind of plan has its few actions."""

import re
from collections.abc import Sequence

from infthor_eval.household.affordances import KNOWN_TYPES
from infthor_eval.household.wording import compact

__all__ = ["read_plan", "scripted"]

_TYPES = {compact(name): name for name in sorted(KNOWN_TYPES)}
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


def scripted(plan: str, done: Sequence[str]) -> str:
    """The next action.

    Args:
        plan: its text.
        done: the actions so far.
    """
    actions = _actions(*read_plan(plan))
    return actions[min(len(done), len(actions) - 1)]


def _actions(verb: str, types: tuple[str, ...]) -> list[str]:
    """The whole script; of the last action more follow."""
    item = types[0] if types else ""
    match verb:
        case "open" | "close" | "slice":
            return [f"{verb.capitalize()}Object {item}"]
        case "pick up":
            return [f"PickupObject {item}"]
        case "toggle":
            return [f"ToggleObjectOn {item}"]
        case "put" if len(types) == 2:
            return _inside(types[1], [f"PutObject {item} {types[1]}"])
        case "wash":
            return [
                f"PutObject {item} SinkBasin",
                "ToggleObjectOn Faucet",
                "ToggleObjectOff Faucet",
                f"PickupObject {item}",
            ]
        case "heat":
            put, take = (_inside("Microwave", [act]) for act in (f"PutObject {item} Microwave", f"PickupObject {item}"))
            return [*put, "ToggleObjectOn Microwave", "ToggleObjectOff Microwave", *take]
        case "cool":
            put, take = (_inside("Fridge", [act]) for act in (f"PutObject {item} Fridge", f"PickupObject {item}"))
            return [*put, *take]
    return ["MoveAhead"]


def _inside(receptacle: str, actions: list[str]) -> list[str]:
    """The actions with the receptacle opened before and closed behind them, where such a one is closed at first."""
    if receptacle not in _CLOSED:
        return actions
    return [f"OpenObject {receptacle}", *actions, f"CloseObject {receptacle}"]
