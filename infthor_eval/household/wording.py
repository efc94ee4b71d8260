"""Object types as English words.

The words keep the type recoverable: a type is split at its capitals ("CoffeeTable" to "coffee table") and
nothing is renamed, so joining the words again gives the type but for capitals.
"""

import re

__all__ = ["an", "compact", "noun", "plural"]

_VOWEL_SOUND = re.compile(r"^(?:[aeio]|u(?!se|ni))", re.IGNORECASE)
_LETTERS = {"CD": "CD", "TVStand": "TV stand", "Television": "television"}
_BARE = {"blinds", "boots", "bread", "curtains", "lettuce", "toilet paper"}  # plural, or not counted
_IRREGULAR = {"knife": "knives", "butter knife": "butter knives", "shelf": "shelves", "bread": "loaves of bread"}


def noun(kind: str) -> str:
    """An object type in words: "CoffeeTable" to "coffee table", "AppleSliced" to "sliced apple"."""
    if kind in _LETTERS:
        return _LETTERS[kind]
    if kind.endswith("Sliced"):
        return f"sliced {noun(kind.removesuffix('Sliced'))}"
    words: list[str] = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[a-z0-9]+", kind)
    return " ".join(word.lower() for word in words)


def an(words: str) -> str:
    """The words with "a" or "an" before them; plurals ("boots") and substances ("bread") stay as they are."""
    if words.removeprefix("sliced ") in _BARE:
        return words
    return f"{'an' if _VOWEL_SOUND.match(words) else 'a'} {words}"


def plural(words: str) -> str:
    """The plural of a noun made by `noun`."""
    if words in _IRREGULAR:
        return _IRREGULAR[words]
    if words.endswith(("s", "x", "ch", "sh")):
        return f"{words}es"
    if words.endswith(("tomato", "potato")):
        return f"{words}es"
    if words.endswith("y") and words[-2] not in "aeiou":
        return f"{words[:-1]}ies"
    return f"{words}s"


def compact(kind: str) -> str:
    """An object type as the published data write it: lower case in one word ("coffeetable")."""
    return kind.lower()
