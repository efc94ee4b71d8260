"""Replies and records that another submission has, too."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import ClassVar

from infthor_board.case import Case
from infthor_board.expected import Expected
from infthor_board.reading import Problem
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.guessing.blind import questions_by_file, sample_on_clues
from infthor_eval.nieh.guessing.guessers import GUESSERS
from infthor_eval.nieh.guessing.learner import guess_by_learning
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.summary import is_open_ended
from infthor_eval.nieh.scoring import compared_form, plain_form
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[NiehAnswer]

_LEAST_S = 0.01  # shorter durations are equal by chance
_EQUAL_TIMES = 10
_LEAST = 10  # wrong answers that both have, from which on they are compared
_MANY = 30  # replies that may not all be equal
_DIFFERENT = 10  # of which so many are different ones
_MOST = 0.9  # of these, the share that two models may have in common


class CopiedRecords:
    """Two submissions have no durations in common, to a tenth of a millisecond."""

    name: ClassVar[str] = "records"
    reason: ClassVar[str] = "a journal that was copied keeps the times of its requests"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task, other, theirs in _shared(case, others):
            equal = {
                record.seconds
                for record in task.records
                if record.seconds >= _LEAST_S
                and (same := theirs.get(record.key)) is not None
                and same.seconds == record.seconds
            }
            if len(equal) >= _EQUAL_TIMES:
                yield Problem(
                    self.name,
                    f"{task.name}: {len(equal):,} requests took exactly as long as in "
                    f"{other.submission.name}; its records were copied",
                )


class CopiedReplies:
    """Two models do not err alike, where no guess explains it.

    Compared are wrong answers to open questions of both, of which the other's is none that a
    guesser gives. Two submissions of one model and revision may agree.
    """

    name: ClassVar[str] = "copied"
    reason: ClassVar[str] = "models agree on what is right; they do not agree on what is wrong"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task, other, theirs in _shared(case, others):
            if _is_same_model(case, other):
                continue
            if _are_identical(task, theirs):
                yield Problem(
                    self.name,
                    f"{task.name}: every reply is, letter by letter, that of "
                    f"{other.submission.name}; its replies were copied",
                )
                continue
            compared = [
                (_said(record), _said(same))
                for record in task.graded
                if (same := theirs.get(record.key)) is not None
                and _errs(record)
                and _errs(same)
                and _said(same) not in _guesses(task.data).get(record.id, ())
            ]
            equal = sum(ours == same for ours, same in compared)
            if len(compared) >= _LEAST and equal >= _MOST * len(compared):
                yield Problem(
                    self.name,
                    f"{task.name}: of {len(compared):,} wrong answers that nobody guesses, "
                    f"{equal:,} are those of {other.submission.name}; its replies were copied",
                )


def _are_identical(task: Expected, theirs: Mapping[UnitKey, Record]) -> bool:
    """Return True if all replies are equal, of which there are enough, and different ones."""
    replies = {it.key: it.payload.reply for it in task.graded if it.payload.reply is not None}
    of_other = {key: it.payload.reply for key, it in theirs.items() if it.payload.reply is not None}
    enough = len(replies) >= _MANY and len(set(replies.values())) >= _DIFFERENT
    return enough and replies == of_other


def _shared(
    case: Case, others: Sequence[Case]
) -> Iterator[tuple[Expected, Case, Mapping[UnitKey, Record]]]:
    """Yield each task that another, no later submission has, too, with its records there."""
    for other in others:
        if _is_later(other, case):
            continue
        for task in case.tasks:
            for theirs in other.tasks:
                same = theirs.run.header.config.frames == task.run.header.config.frames
                if theirs.name == task.name and same:
                    yield task, other, {record.key: record for record in theirs.graded}


def _is_later(other: Case, case: Case) -> bool:
    """Return True if the other one came later, or says no day, so that it is the copy."""
    ours, theirs = case.submission.statement, other.submission.statement
    if not other.is_candidate or ours is None:
        return False
    return theirs is None or theirs.date > ours.date


def _is_same_model(case: Case, other: Case) -> bool:
    ours, theirs = case.submission.statement, other.submission.statement
    if ours is None or theirs is None:
        return False
    return (ours.model, ours.revision) == (theirs.model, theirs.revision)


def _errs(record: Record) -> bool:
    payload = record.payload
    return payload.reply is not None and is_open_ended(record) and payload.scores["strict"] < 1


def _said(record: Record) -> str:
    return compared_form(record.payload.reply or "", record.payload.answers)


@lru_cache(maxsize=8)
def _guesses(data: NiehSet) -> Mapping[str, frozenset[str]]:
    """Return what guessers that see no frame say to each question, by its id."""
    found: dict[str, set[str]] = {}
    # Not the learners, which take minutes on a large set and say what the others do.
    quick = [it for it in GUESSERS if getattr(it.rule, "func", None) is not guess_by_learning]
    for questions in questions_by_file(data).values():
        samples = [sample_on_clues(question) for question in questions]
        for guesser in quick:
            for question, reply in zip(questions, guesser.guess(samples), strict=True):
                found.setdefault(question.id, set()).add(plain_form(reply).casefold())
    return {name: frozenset(replies) for name, replies in found.items()}
