"""Taking each type of thing for another one, in what frames show as in questions and answers.

A renamed home is as good to learn from as the home, and nobody can know it by heart: which things
lie in which rooms says nothing any more.
"""

import random
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from infthor_eval.household.wording import (
    canonical_type,
    compact_name,
    in_or_on,
    noun,
    plural,
    with_article,
)

_N_TEMPLATES = 100_000  # that are kept


@dataclass(frozen=True)
class Renaming:
    """New types by old ones; the others keep their names."""

    new: Mapping[str, str]

    def __call__(self, object_type: str) -> str:
        """Return the new type of a type."""
        return self.new.get(object_type, object_type)


@dataclass(frozen=True)
class _Slot:
    """A place of a text that names a type.

    Attributes:
        type: the type.
        before: what depends on the type: "in" or "on" with "the", an article, or nothing.
        is_plural: True for a plural.
    """

    type: str
    before: str
    is_plural: bool

    def words(self, renaming: Renaming) -> str:
        """Return the words of the new type."""
        name = renaming(self.type)
        if self.before == "place":
            return in_or_on(name)
        words = plural(noun(name)) if self.is_plural else noun(name)
        return with_article(words) if self.before == "article" else words


class Vocabulary:
    """The types that questions and answers may name.

    Args:
        loose: types of things that can be picked up; they are renamed among each other.
        fixtures: types of receptacles and of what can be opened, likewise.
        others: further types, which keep their names.
    """

    def __init__(
        self, loose: Iterable[str], fixtures: Iterable[str], others: Iterable[str] = ()
    ) -> None:
        self.loose = _canonical(loose)
        self.fixtures = tuple(name for name in _canonical(fixtures) if name not in self.loose)
        types = {*self.loose, *self.fixtures, *_canonical(others)}
        self._by_noun = {noun(name): name for name in types}
        plurals = {plural(words): name for words, name in self._by_noun.items()}
        self._by_plural = {
            words: name for words, name in plurals.items() if words not in self._by_noun
        }
        self._by_compact_name = {compact_name(name): name for name in types}
        longest_first = sorted({**self._by_noun, **self._by_plural}, key=len, reverse=True)
        names = "|".join(map(re.escape, longest_first))
        self._pattern = re.compile(
            rf"\b(?:(?P<place>in|on) the |(?P<article>an|a) )?(?P<name>{names})\b"
        )
        self._template = lru_cache(_N_TEMPLATES)(self._find_slots)

    def draw(self, rng: random.Random) -> Renaming:
        """Return a random renaming."""
        new: dict[str, str] = {}
        for group in (self.loose, self.fixtures):
            new |= zip(group, rng.sample(group, len(group)), strict=True)
        return Renaming(new)

    def rename(self, text: str, renaming: Renaming) -> str:
        """Return a question about renamed things."""
        return "".join(
            part if isinstance(part, str) else part.words(renaming) for part in self._template(text)
        )

    def rename_answer(self, answer: str, renaming: Renaming) -> str:
        """Return a gold answer about renamed things; numbers, yes and no stay."""
        name = self._by_compact_name.get(answer)
        return answer if name is None else compact_name(renaming(name))

    def form(self, text: str) -> str:
        """Return a question without the types that it names, the same for all that ask so."""
        return "".join(part if isinstance(part, str) else "_" for part in self._template(text))

    def phrases(self, text: str) -> list[str]:
        """Return the parts of a question that name no type, as they follow what is before them."""
        parts = (part.rstrip() for part in self._template(text) if isinstance(part, str))
        return [part if part.startswith(" ") else f" {part}" for part in parts if part]

    def _find_slots(self, text: str) -> Sequence[str | _Slot]:
        parts: list[str | _Slot] = []
        done = 0
        for match in self._pattern.finditer(text):
            words = match["name"]
            is_plural = words not in self._by_noun
            name = self._by_plural[words] if is_plural else self._by_noun[words]
            before = next((kind for kind in ("place", "article") if match[kind]), "")
            parts += [text[done : match.start()], _Slot(name, before, is_plural)]
            done = match.end()
        return (*parts, text[done:])


def _canonical(types: Iterable[str]) -> tuple[str, ...]:
    """Return types once each, sorted; slices are no types of their own."""
    return tuple(
        sorted({canonical_type(name) for name in types if not name.endswith(("Sliced", "Cracked"))})
    )
