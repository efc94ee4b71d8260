"""Object ids: what they say about an object, and the names that they give it.

Ids are "Type|x|y|z". Parts have the type of the part at the end ("Sink|...|SinkBasin"), slices also
a number after an underscore ("Apple|...|AppleSliced_2").
"""

from enum import StrEnum

# Types of AI2-THOR 2.1.0, as in ALFRED and the published trajectories, that 5.x calls otherwise.
_RENAMED = {
    "Glassbottle": "Bottle",
    "PaperTowel": "PaperTowelRoll",
    "ToiletPaperRoll": "ToiletPaper",
}


def object_type_of(object_id: str) -> str:
    """Return the object type in an object id."""
    parts = object_id.split("|")
    return parts[4].split("_")[0] if len(parts) > 4 else parts[0]


def modern_type(object_type: str) -> str:
    """Return the name in AI2-THOR 5.x of a type that 2.1.0 may have called otherwise."""
    return _RENAMED.get(object_type, object_type)


def name_of_original(name: str) -> str:
    """Return the name of the object that one with this name is a copy of, or its own."""
    return name.partition("(Clone)")[0]


class Words(StrEnum):
    """The words in which plans and actions name objects.

    `PUBLISHED` are those of the published scripts: the first part of an object's id, so that a
    slice of bread is "Bread" and the basin of a sink is "Sink". `NATURAL` are the objects' own
    types: "BreadSliced", "SinkBasin".
    """

    PUBLISHED = "published"
    NATURAL = "natural"

    def name_of(self, object_id: str) -> str:
        """Return the name of an object."""
        return (
            object_id.split("|", maxsplit=1)[0]
            if self is Words.PUBLISHED
            else object_type_of(object_id)
        )
