"""Which objects go where, and what can be done to them: what makes a task sensible.

The tables are the published ones (`affordances.yaml`), narrower than what AI2-THOR allows: it would take a statue into
the sink basin. Types are those of AI2-THOR 5.x.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

__all__ = [
    "CLEANABLE",
    "COOLABLE",
    "GOALS_BY_ROOM",
    "HEATABLE",
    "KNIVES",
    "KNOWN_TYPES",
    "LIGHTS",
    "MAX_PLAN_STEPS",
    "MOVABLE_RECEPTACLES",
    "SLICEABLE",
    "STOWABLE",
    "goes_into",
    "modern_type",
    "preposition",
]

_TABLES: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("affordances.yaml").read_text())
_RENAMED = {"Glassbottle": "Bottle", "PaperTowel": "PaperTowelRoll", "ToiletPaperRoll": "ToiletPaper"}  # 2.1.0 to 5.x


def modern_type(name: str) -> str:
    """The name that AI2-THOR 5.x has for an object type of 2.1.0; one of 5.x stays as it is."""
    return _RENAMED.get(name, name)


def _types(names: Iterable[str]) -> frozenset[str]:
    return frozenset(map(modern_type, names))


_HOLDS = {receptacle: _types(names) for receptacle, names in _TABLES["receptacle_holds"].items()}
_ACTIONS = {action: _types(names) for action, names in _TABLES["action_objects"].items()}

CLEANABLE, COOLABLE, HEATABLE = (_ACTIONS[name] for name in ("Cleanable", "Coolable", "Heatable"))
STOWABLE = frozenset[str]().union(*_HOLDS.values())  # what goes anywhere at all
# The table has the egg too, but a cut egg is cracked: it leaves nothing that could be put anywhere.
SLICEABLE = frozenset(name for name in _ACTIONS["Sliceable"] if f"{name}Sliced" in STOWABLE)
KNIVES = frozenset({"ButterKnife", "Knife"})
LIGHTS = _ACTIONS["Toggleable"]
MOVABLE_RECEPTACLES = _types(_TABLES["movable_receptacles"])
GOALS_BY_ROOM: dict[str, frozenset[str]] = {name: frozenset(rooms) for name, rooms in _TABLES["goals_by_room"].items()}
KNOWN_TYPES = STOWABLE.union(_HOLDS, KNIVES, *_ACTIONS.values(), {"Faucet", "Microwave"})  # that tasks are about
MAX_PLAN_STEPS: int = _TABLES["planner_max_steps"]

_INSIDE = frozenset(
    {"BathtubBasin", "Bowl", "Box", "Cabinet", "Cup", "Drawer", "Fridge", "GarbageCan", "LaundryHamper"}
    | {"Microwave", "Mug", "Pan", "Pot", "Safe", "Sink", "SinkBasin"}
)


def goes_into(item: str, receptacle: str) -> bool:
    """Whether it is sensible to put an object of type `item` into or onto a receptacle of type
    `receptacle`."""
    return item in _HOLDS.get(receptacle, frozenset())


def preposition(receptacle: str) -> str:
    """ "in" or "on", as fits the receptacle type."""
    return "in" if receptacle in _INSIDE else "on"
