"""The receptacles that each object type can be put into, and the actions that apply to it.

The tables are the published ones (`affordances.yaml`). They are narrower than what AI2-THOR allows,
which would accept a statue in the sink basin. Types are those of AI2-THOR 5.x.

To add or change which objects fit where, and which tasks a room: `affordances.yaml`, the published
tables.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.formats.object_ids import modern_type

_TABLES: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("affordances.yaml").read_text())


def _types(names: Iterable[str]) -> frozenset[str]:
    return frozenset(map(modern_type, names))


_HOLDS = {receptacle: _types(names) for receptacle, names in _TABLES["receptacle_holds"].items()}
_ACTIONS = {action: _types(names) for action, names in _TABLES["action_objects"].items()}

CLEANABLE = _ACTIONS["Cleanable"]
COOLABLE = _ACTIONS["Coolable"]
HEATABLE = _ACTIONS["Heatable"]
STOWABLE = frozenset[str]().union(*_HOLDS.values())  # types with at least one receptacle
# Without the egg of the published table: a sliced egg is cracked and leaves nothing that could be
# put anywhere.
SLICEABLE = frozenset(name for name in _ACTIONS["Sliceable"] if f"{name}Sliced" in STOWABLE)
KNIVES = frozenset({"ButterKnife", "Knife"})
LIGHTS = _ACTIONS["Toggleable"]
MOVABLE_RECEPTACLES = _types(_TABLES["movable_receptacles"])
GOALS_BY_ROOM: dict[str, frozenset[str]] = {
    name: frozenset(rooms) for name, rooms in _TABLES["goals_by_room"].items()
}
# All types in tasks.
KNOWN_TYPES = STOWABLE.union(_HOLDS, KNIVES, *_ACTIONS.values(), {"Faucet", "Microwave"})
MAX_PLAN_STEPS: int = _TABLES["planner_max_steps"]

_INSIDE = frozenset(
    {
        "BathtubBasin",
        "Bowl",
        "Box",
        "Cabinet",
        "Cup",
        "Drawer",
        "Fridge",
        "GarbageCan",
        "LaundryHamper",
    }
    | {"Microwave", "Mug", "Pan", "Pot", "Safe", "Sink", "SinkBasin"}
)


def goes_into(object_type: str, receptacle: str) -> bool:
    """Return True if the published table has an object type for a receptacle type."""
    return object_type in _HOLDS.get(receptacle, frozenset())


def preposition(receptacle: str) -> str:
    """Return "in" or "on" for a receptacle type."""
    return "in" if receptacle in _INSIDE else "on"
