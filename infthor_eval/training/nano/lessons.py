"""What the small model is told: questions of sets, questions made up on any frame, and histories to act from."""

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.household.sequence_text import MARKS
from infthor_eval.household.wording import an, noun
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.samples import find_samples
from infthor_eval.training.data import action_sequences
from infthor_eval.training.encoding import Encoded, Encoder
from infthor_eval.training.nano.album import Album
from infthor_eval.training.nano.network import ways_of_writing
from infthor_eval.training.question_sequences import question_sequences
from model_adapters import Part

__all__ = ["Lessons", "opening", "texts"]

_LEAST_SEEN = 20  # frames that show a type that is asked about in questions that are made up
_FORMS = ("Have you seen {0}?", "Is there any {1} in this room?")
_TRIES = 200


def opening() -> str:
    """What every question on clue frames begins with."""
    return question_text(CONTEXTS["clues"].intro, Question("", "", (), ())).rstrip()


def texts(folders: Sequence[Path], types: Sequence[str]) -> Iterator[str]:
    """Everything that is said in sets, for a tokenizer that is to know its words."""
    for object_type in types:
        yield from ways_of_writing(object_type)
        yield object_type
    for folder in folders:
        for path in sorted((folder / "metadata").glob("*/traj.txt")):
            said = path.read_text(encoding="utf-8").replace("<image>", " ")
            for mark in MARKS:
                said = said.replace(mark, "\n")
            yield from said.splitlines()
        for question in NiehSet(folder).questions:
            yield f" {question.text}"
            yield from (f"{way}{answer}" for answer in question.answers for way in ("", " "))
    yield from map(str, range(30))
    yield opening()


class Lessons:
    """Sequences to learn from, drawn by a seed.

    Args:
        encoder: makes them.
        folders: of replayed sets, with questions.
        album: all their frames.
        window_tokens: of a history at most.
        seed: of the draws.
    """

    def __init__(
        self, encoder: Encoder, folders: Sequence[Path], album: Album, *, window_tokens: int, seed: int
    ) -> None:
        self._encoder = encoder
        self._album = album
        self._draw = random.Random(seed)
        self._questions: list[Encoded] = []
        self._histories: list[Encoded] = []
        for folder in folders:
            asked = find_samples({"data": str(folder), "context": "clues"})
            made = (*question_sequences(encoder, asked, window_tokens),)
            self._questions += [item for item in made if isinstance(item, Encoded)]
            cut = action_sequences(NiehSet(folder), encoder, window_tokens)
            self._histories += [item for item in cut if isinstance(item, Encoded)]
        counts = album.shown.sum(0).tolist()
        often = {name: count for name, count in zip(album.types, counts, strict=True) if count >= _LEAST_SEEN}
        self._names, self._weights = list(often), list(often.values())

    def questions(self, n: int, made_up: float) -> list[Encoded]:
        """Some questions with their answers, a share of them made up."""
        return [
            self._presence() if self._draw.random() < made_up else self._draw.choice(self._questions) for _ in range(n)
        ]

    def histories(self, n: int) -> list[Encoded]:
        """Some histories with their actions."""
        return [self._draw.choice(self._histories) for _ in range(n)]

    def frames(self, n: int) -> list[int]:
        """Places of some frames in the album."""
        return self._draw.sample(range(len(self._album.frames)), min(n, len(self._album.frames)))

    def way(self, n_ways: int) -> int:
        """One of the ways of writing names."""
        return self._draw.randrange(n_ways)

    def _presence(self) -> Encoded:
        """A question for an object's presence on one frame; the name tells nothing of the answer.

        Names are drawn as often as frames show them, for yes as for no.
        """
        is_there = self._draw.random() < 0.5
        for _ in range(_TRIES):
            (name,) = self._draw.choices(self._names, self._weights)
            place = self._draw.randrange(len(self._album.frames))
            kind = self._album.types.index(name)
            if (self._album.shown if is_there else 1 - self._album.present)[place, kind]:
                break
        words = noun(name)
        text = self._draw.choice(_FORMS).format(an(words), words)
        asked = question_text(CONTEXTS["clues"].intro, Question("", text, (), ()))
        parts: list[Part] = [self._album.frames[place], asked]
        return self._encoder.answer("made up", parts, "yes" if self._album.shown[place, kind] else "no")
