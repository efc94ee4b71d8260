"""All types by name, and which may be put into or onto which."""

from infthor_sim.object_types import appliances, fixtures, food, furniture, household, kitchenware
from infthor_sim.object_types.record import ObjectType

__all__ = ["OBJECT_TYPES", "allowed_in", "type_named"]

OBJECT_TYPES: dict[str, ObjectType] = {
    declared.name: declared
    for theme in (appliances, fixtures, food, furniture, household, kitchenware)
    for declared in theme.TYPES
}


def type_named(name: str) -> ObjectType:
    """Return the record of a type; a type without one has no abilities and is a plain box."""
    return OBJECT_TYPES.get(name) or ObjectType(name)


def allowed_in(item: str, receptacle: str) -> bool:
    """Return whether AI2-THOR lets an object of type `item` be put into or onto a receptacle of
    type `receptacle`."""
    return type_named(receptacle).accepts(type_named(item))
