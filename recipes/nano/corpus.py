"""The words of the small model: texts that its tokenizer is trained on, and texts of one token."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.household.sequence_text import MARKS
from infthor_eval.household.wording import noun
from recipes.nano.reading.asking import question_intro
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.spelling import spellings

_MOST_COUNTED = 30  # numbers up to this are words
_BEFORE_PLACES = (" in the", " on the")


def corpus_texts(folders: Sequence[Path], types: Iterable[str]) -> Iterator[str]:
    """Yield all texts of the sets, for training a tokenizer that has their words."""
    for object_type in types:
        yield from spellings(object_type)
        yield object_type
    for folder in folders:
        for path in sorted((folder / "metadata").glob("*/traj.txt")):
            text = path.read_text(encoding="utf-8").replace("<image>", " ")
            for mark in MARKS:
                text = text.replace(mark, "\n")
            yield from text.splitlines()
        for question in NiehSet(folder).questions:
            yield f" {question.text}"
            yield from (f"{space}{answer}" for answer in question.answers for space in ("", " "))
    yield from map(str, range(_MOST_COUNTED))
    yield question_intro()


def single_tokens(
    folders: Sequence[Path], vocabulary: Vocabulary, types: Iterable[str]
) -> list[str]:
    """Return the texts of several words that become one token.

    They are the introduction of every question of the published evaluation, which would otherwise
    be three quarters of a question's tokens; what questions say around the things that they name;
    and the names of these.
    """
    names = [f" {noun(name)}" for name in types]
    phrases = {
        phrase
        for folder in folders
        for question in NiehSet(folder).questions
        for phrase in vocabulary.phrases(question.text)
    }
    texts = [*_BEFORE_PLACES, *sorted(phrases), *names]
    return [question_intro(), *dict.fromkeys(text for text in texts if " " in text.strip())]
