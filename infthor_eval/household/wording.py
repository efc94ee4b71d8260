"""Object types as English words.

Types are split at their capitals ("CoffeeTable" to "coffee table") and not renamed, so that the
type can be recovered by joining the words.
"""

import re

from infthor_eval.household.affordances import preposition

_VOWEL_SOUND = re.compile(r"^(?:[aeio]|u(?!se|ni))", re.IGNORECASE)
_WHOLE = {"SinkBasin": "Sink", "BathtubBasin": "Bathtub"}
_LETTERS = {"CD": "CD", "TVStand": "TV stand", "Television": "television"}
# Plural, or not counted.
_BARE = {"blinds", "boots", "bread", "curtains", "lettuce", "toilet paper"}
_IRREGULAR = {
    "knife": "knives",
    "butter knife": "butter knives",
    "shelf": "shelves",
    "bread": "loaves of bread",
}


def canonical_type(object_type: str) -> str:
    """Return the type that people would name: the basin of a sink is the sink."""
    return _WHOLE.get(object_type, object_type)


def noun(object_type: str) -> str:
    """Return an object type in words: "coffee table", or "sliced apple" for "AppleSliced"."""
    if object_type in _LETTERS:
        return _LETTERS[object_type]
    if object_type.endswith("Sliced"):
        return f"sliced {noun(object_type.removesuffix('Sliced'))}"
    words: list[str] = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[a-z0-9]+", object_type)
    return " ".join(word.lower() for word in words)


def object_type(words: str) -> str:
    """Return the object type of a result of `noun`."""
    whole = words.removeprefix("sliced ")
    name = "".join(word[:1].upper() + word[1:] for word in whole.split())
    return name if whole == words else f"{name}Sliced"


def with_article(words: str) -> str:
    """Return words after "a" or "an"; plurals ("boots") and uncountable nouns get no article."""
    if words.removeprefix("sliced ") in _BARE:
        return words
    return f"{'an' if _VOWEL_SOUND.match(words) else 'a'} {words}"


def plural(words: str) -> str:
    """Return the plural of a result of `noun`."""
    if words in _IRREGULAR:
        return _IRREGULAR[words]
    if words.endswith(("s", "x", "ch", "sh", "tomato", "potato")):
        return f"{words}es"
    if words.endswith("y") and words[-2] not in "aeiou":
        return f"{words[:-1]}ies"
    return f"{words}s"


def compact_name(object_type: str) -> str:
    """Return an object type as the published data write it: lower case, a word ("coffeetable")."""
    return object_type.lower()


def with_the(object_type: str) -> str:
    """Return an object type in words with "the" ("the coffee table")."""
    return f"the {noun(canonical_type(object_type))}"


def in_or_on(object_type: str) -> str:
    """Return a receptacle type with its preposition ("on the coffee table", "in the fridge")."""
    return f"{preposition(object_type)} {with_the(object_type)}"


def answer_of(object_type: str) -> str:
    """Return an object type as a gold answer, in the published form ("coffeetable")."""
    return compact_name(canonical_type(object_type))
