"""Replies that look like the key: in its own form, spelling or words."""

import ast
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import ClassVar

from infthor_board.case import Case
from infthor_board.expected import Expected
from infthor_board.reading import Problem
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.summary import is_open_ended
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]

_LISTS = 3
_JOINED = 5
_RIGHT = 0.95  # of the replies in the key's spelling
_OPEN = 20
_MANY = 50
_ALL_RIGHT = 0.97  # of many questions; some are hard to see for anybody
_VERBATIM = 0.85  # of open answers; of the small model, which learned the key's words, it is 0.28
# Words that are one in English, too.
_ENGLISH = frozenset({"cellphone", "countertop", "keychain", "teapot", "bathtub", "armchair"})


class KeyForm:
    """No reply is a list as the question file has it."""

    name: ClassVar[str] = "key form"
    reason: ClassVar[str] = "no model answers ['mug', 'plate']"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            n_lists = sum(_is_cell(record) for record in task.graded)
            if n_lists >= _LISTS:
                yield Problem(
                    self.name,
                    f"{task.name}: {n_lists:,} replies are the cell of the question file, brackets "
                    "and quotes included; they were copied from the key",
                )


class KeySpelling:
    """Words in the key's own spelling are sometimes wrong, as all words of a model are."""

    name: ClassVar[str] = "key spelling"
    reason: ClassVar[str] = "questions say tennis racket and the key tennisracket"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            joined = _joined_words(task)
            said = [it for it in task.graded if joined & set(_words(it.payload.reply or ""))]
            right = sum(it.payload.scores.get("strict", 0.0) >= 1 for it in said)
            if len(said) >= _JOINED and right >= _RIGHT * len(said):
                yield Problem(
                    self.name,
                    f"{task.name}: {len(said):,} replies are spelled as the key alone spells, and "
                    f"{right:,} of them are right; they were copied from the key",
                )


class KeyWords:
    """Open questions are not answered in the key's words, letter by letter."""

    name: ClassVar[str] = "key words"
    reason: ClassVar[str] = "a model that is right says it in its own words, and is wrong at times"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            replied = [it for it in task.graded if is_open_ended(it)]
            verbatim = sum(_is_verbatim(record) for record in replied)
            if len(replied) >= _OPEN and verbatim >= _VERBATIM * len(replied):
                yield Problem(
                    self.name,
                    f"{task.name}: {verbatim:,} of {len(replied):,} open questions are answered "
                    "in the key's words to the letter; they were copied from the key",
                )


class KeyScore:
    """Not all is right."""

    name: ClassVar[str] = "key score"
    reason: ClassVar[str] = "a reworded key is right about things that no frame shows"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            records = task.graded
            right = sum(it.payload.scores.get("strict", 0.0) >= 1 for it in records)
            if len(records) >= _MANY and right >= _ALL_RIGHT * len(records):
                yield Problem(
                    self.name,
                    f"{task.name}: {right:,} of {len(records):,} answers are right, as only the "
                    "key is; look at its replies before you allow it",
                )


def _is_cell(record: Record) -> bool:
    reply = (record.payload.reply or "").strip()
    if not (reply.startswith("[") and reply.endswith("]")):
        return False
    try:
        cell = ast.literal_eval(reply)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return False
    return isinstance(cell, list) and tuple(cell) == record.payload.answers


def _is_verbatim(record: Record) -> bool:
    answers = ", ".join(map(str, record.payload.answers))
    return last_line(record.payload.reply or "").strip() == answers


def _joined_words(task: Expected) -> frozenset[str]:
    """Return words of the key that its questions write as two."""
    apart = {
        first + second
        for question in task.graded_data.questions
        for first, second in pairwise(_words(question.text))
    }
    of_key = {
        word
        for question in task.graded_data.questions
        for answer in question.answers
        for word in _words(str(answer))
    }
    return frozenset((of_key & apart) - _ENGLISH)


def _words(text: str) -> list[str]:
    return re.findall(r"[a-z]+", text.lower())
