"""The types of objects: one record each, in a table by theme.

To add an object type: a record in `table.py`; if a plain box is not enough, a function with
`@draws` in `infthor_sim/render/shapes/`, whose name is the record's `shape`.
"""

from infthor_sim.object_types.record import ObjectType
from infthor_sim.object_types.table import TYPES

__all__ = ["FORMER_NAMES", "OBJECT_TYPES", "ObjectType", "allowed_in", "modern_type", "type_named"]

OBJECT_TYPES = {declared.name: declared for declared in TYPES}

FORMER_NAMES = {
    "Glassbottle": "Bottle",
    "PaperTowel": "PaperTowelRoll",
    "ToiletPaperRoll": "ToiletPaper",
}
"""Types of AI2-THOR 2.1.0, as in ALFRED, that 5.x calls otherwise; the names in 5.x."""


def modern_type(name: str) -> str:
    """Return the name in AI2-THOR 5.x of a type that 2.1.0 may have called otherwise."""
    return FORMER_NAMES.get(name, name)


def type_named(name: str) -> ObjectType:
    """Return the record of a type; a type without one has no abilities and is a plain box."""
    return OBJECT_TYPES.get(name) or ObjectType(name)


def allowed_in(item: str, receptacle: str) -> bool:
    """Return whether AI2-THOR lets an object of one type be put into or onto another."""
    return type_named(receptacle).accepts(type_named(item))
