"""Fixed actions for the words of a plan, executed without looking."""

import re
from collections.abc import Sequence

from infthor_eval.household.affordances import KNOWN_TYPES
from infthor_eval.household.wording import compact_name

_TYPES = {compact_name(name): name for name in sorted(KNOWN_TYPES)}
_TYPES |= {"sink": "SinkBasin", "bathtub": "BathtubBasin"}  # things are put into the basin
# At first, as a rule.
_CLOSED = frozenset({"Box", "Cabinet", "Drawer", "Fridge", "Laptop", "Microwave", "Safe"})
_VERBS = ("go to", "open", "close", "pick up", "put", "wash", "heat", "cool", "toggle", "slice")
# The usual form: a verb, an object, and the receptacle of some verbs.
PLAN = re.compile(rf"({'|'.join(_VERBS)}) (?:the )?(\S+)(?: in the (\S+))?")


def read_plan(plan: str) -> tuple[str, tuple[str, ...]]:
    """Return the verb of a plan and the objects that it names.

    Natural words in lower case become object types; the published names are in capitals and stay as
    they are, as any other word does.

    Args:
        plan: text of the plan ("put the mug in the sink", or "put the Mug in the Sink").

    Returns:
        ("put", ("Mug", "SinkBasin")), or ("put", ("Mug", "Sink")); the whole text and no objects if
        it is not of the usual form.
    """
    match = PLAN.fullmatch(plan)
    if match is None:
        return plan, ()
    verb, *words = match.groups()
    return verb, tuple(_TYPES.get(word, word) for word in words if word is not None)


def scripted_action(plan: str, done: Sequence[str]) -> str:
    """Return the next action of a plan's script after those done; its last one is repeated."""
    actions = _script(*read_plan(plan))
    return actions[min(len(done), len(actions) - 1)]


def _script(verb: str, types: tuple[str, ...]) -> list[str]:
    item, receptacle = (*types, "", "")[:2]
    scripts = {
        "open": [f"OpenObject {item}"],
        "close": [f"CloseObject {item}"],
        "slice": [f"SliceObject {item}"],
        "pick up": [f"PickupObject {item}"],
        "toggle": [f"ToggleObjectOn {item}"],
        "put": _inside(receptacle, f"PutObject {item} {receptacle}"),
        "wash": _treat(item, "SinkBasin", _switch("Faucet")),
        "heat": _treat(item, "Microwave", _switch("Microwave")),
        "cool": _treat(item, "Fridge", []),
    }
    return scripts.get(verb, ["MoveAhead"])


def _switch(name: str) -> list[str]:
    return [f"ToggleObjectOn {name}", f"ToggleObjectOff {name}"]


def _treat(item: str, appliance: str, treatment: list[str]) -> list[str]:
    put = f"PutObject {item} {appliance}"
    take = f"PickupObject {item}"
    return [*_inside(appliance, put), *treatment, *_inside(appliance, take)]


def _inside(receptacle: str, action: str) -> list[str]:
    """Return the action, within opening and closing the receptacle if it is closed at first."""
    if receptacle not in _CLOSED:
        return [action]
    return [f"OpenObject {receptacle}", action, f"CloseObject {receptacle}"]
