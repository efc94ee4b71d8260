"""Kinds of rooms by what is in them, as logs of any simulator have no common name for them."""

from collections.abc import Set

__all__ = ["rooms_of"]

# In AI2-THOR's rooms and in ours each of these stands in one kind of room alone.
_MARKS = {
    "Kitchen": {"Fridge", "StoveBurner"},
    "Bedroom": {"Bed"},
    "Bathroom": {"Toilet"},
    "LivingRoom": {"Sofa"},
}


def rooms_of(types: Set[str]) -> str:
    """Return the kinds of a scene's rooms by the types of its objects: "Kitchen", or "Kitchen,
    Bedroom" for a house.

    A room without any mark is a living room. A bedroom with a sofa is a bedroom.
    """
    rooms = [room for room, marks in _MARKS.items() if marks & types]
    if rooms == ["Bedroom", "LivingRoom"]:
        rooms = ["Bedroom"]
    return ", ".join(rooms) or "LivingRoom"
