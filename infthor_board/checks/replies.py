"""Whether replies are a model's own: not another submission's, not the key's, not one world's for
both; and whether their score is above what blindness and knowledge of homes give.

The last two are warnings: who is no better than `blind` is not thereby dishonest. The row says it.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise

import scipy.stats

from infthor_board.case import Case, Remark, check
from infthor_board.expected import Expected
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.guessing.blind import questions_by_file, sample_on_clues
from infthor_eval.nieh.guessing.guessers import GUESSERS
from infthor_eval.nieh.guessing.learner import guess_by_learning
from infthor_eval.nieh.options import OTHER
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.above_blind import above_blind
from infthor_eval.nieh.results.pair_summary import (
    TwinRecords,
    find_pairs,
    is_flipped,
    is_right,
    summarise_pairs,
)
from infthor_eval.nieh.results.summary import is_open_ended
from infthor_eval.nieh.scoring import compared_form, plain_form
from infthor_eval.rates import clustered_rate
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.statistics import paired_difference

Record = UnitRecord[NiehAnswer]

_LEAST_S = 0.01  # shorter durations are equal by chance
_EQUAL_TIMES = 10
_LEAST = 10  # wrong answers that both have, from which on they are compared
_MANY = 30  # replies that may not all be equal
_DIFFERENT = 10  # of which so many are different ones
_MOST = 0.9  # of these, the share that two models may have in common
_LISTS = 3
_JOINED = 5
_RIGHT = 0.95  # of the replies in the key's spelling
_OPEN = 20
_MANY_QUESTIONS = 50
_ALL_RIGHT = 0.97  # of these; some are hard to see for anybody
_VERBATIM = 0.85  # of open answers; of the small model, which learned the key's words, it is 0.28
# Words that are one in English, too.
_ENGLISH = frozenset({"cellphone", "countertop", "keychain", "teapot", "bathtub", "armchair"})
_SAME = 5  # pairs with equal requests and other replies
_SAME_SHARE = 0.1
_CHANCE = 1e-6
_SINGLES = 0.9
_PAIRS = 0.05
_LEAST_PAIRS = 30


@check("records")
def copied_records(case: Case) -> Iterator[str]:
    """Two submissions have no durations in common, to a tenth of a millisecond: a journal that was
    copied keeps the times of its requests."""
    for task, other, theirs in _shared(case):
        equal = {
            record.seconds
            for record in task.records
            if record.seconds >= _LEAST_S
            and (same := theirs.get(record.key)) is not None
            and same.seconds == record.seconds
        }
        if len(equal) >= _EQUAL_TIMES:
            yield (
                f"{task.name}: {len(equal):,} requests took exactly as long as in "
                f"{other.submission.name}; its records were copied"
            )


@check("copied")
def copied_replies(case: Case) -> Iterator[str]:
    """Two models do not err alike, where no guess explains it: models agree on what is right; they
    do not agree on what is wrong.

    Compared are wrong answers to open questions of both, of which the other's is none that a
    guesser gives. Two submissions of one model and revision may agree.
    """
    for task, other, theirs in _shared(case):
        if _is_same_model(case, other):
            continue
        if _are_identical(task, theirs):
            yield (
                f"{task.name}: every reply is, letter by letter, that of "
                f"{other.submission.name}; its replies were copied"
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
            yield (
                f"{task.name}: of {len(compared):,} wrong answers that nobody guesses, "
                f"{equal:,} are those of {other.submission.name}; its replies were copied"
            )


def _are_identical(task: Expected, theirs: Mapping[UnitKey, Record]) -> bool:
    """Return True if all replies are equal, of which there are enough, and different ones."""
    replies = {it.key: it.payload.reply for it in task.graded if it.payload.reply is not None}
    of_other = {key: it.payload.reply for key, it in theirs.items() if it.payload.reply is not None}
    enough = len(replies) >= _MANY and len(set(replies.values())) >= _DIFFERENT
    return enough and replies == of_other


def _shared(case: Case) -> Iterator[tuple[Expected, Case, Mapping[UnitKey, Record]]]:
    """Yield each task that another, no later submission has, too, with its records there."""
    for other in case.others:
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


@check("key form")
def key_form(case: Case) -> Iterator[str]:
    """No reply is a list as the question file has it: no model answers ['mug', 'plate']."""
    for task in case.shown:
        n_lists = sum(_is_cell(record) for record in task.graded)
        if n_lists >= _LISTS:
            yield (
                f"{task.name}: {n_lists:,} replies are the cell of the question file, brackets "
                "and quotes included; they were copied from the key"
            )


@check("key spelling")
def key_spelling(case: Case) -> Iterator[str]:
    """Words in the key's own spelling are sometimes wrong, as all words of a model are: questions
    say tennis racket and the key tennisracket."""
    for task in case.shown:
        joined = _joined_words(task)
        said = [it for it in task.graded if joined & set(_words(it.payload.reply or ""))]
        right = sum(it.payload.scores.get("strict", 0.0) >= 1 for it in said)
        if len(said) >= _JOINED and right >= _RIGHT * len(said):
            yield (
                f"{task.name}: {len(said):,} replies are spelled as the key alone spells, and "
                f"{right:,} of them are right; they were copied from the key"
            )


@check("key words")
def key_words(case: Case) -> Iterator[str]:
    """Open questions are not answered in the key's words, letter by letter: a model that is right
    says it in its own words, and is wrong at times."""
    for task in case.shown:
        replied = [it for it in task.graded if is_open_ended(it)]
        verbatim = sum(_is_verbatim(record) for record in replied)
        if len(replied) >= _OPEN and verbatim >= _VERBATIM * len(replied):
            yield (
                f"{task.name}: {verbatim:,} of {len(replied):,} open questions are answered "
                "in the key's words to the letter; they were copied from the key"
            )


@check("key score")
def key_score(case: Case) -> Iterator[str]:
    """Not all is right: a reworded key is right about things that no frame shows."""
    for task in case.shown:
        records = task.graded
        right = sum(it.payload.scores.get("strict", 0.0) >= 1 for it in records)
        if len(records) >= _MANY_QUESTIONS and right >= _ALL_RIGHT * len(records):
            yield (
                f"{task.name}: {right:,} of {len(records):,} answers are right, as only the "
                "key is; look at its replies before you allow it"
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


@check("pairs alike")
def pairs_of_what_differs(case: Case) -> Iterator[str]:
    """Where both worlds were shown the same frames, greedy replies are the same: one request has
    one greedy reply: another one came from elsewhere."""
    for task in case.tasks:
        if task.run.is_export or task.stated.decoding.get("temperature"):  # which samples
            continue
        alike = [pair for pair in find_pairs(task.graded)[0] if _is_alike(pair)]
        flipped = sum(is_flipped(*pair) for pair in alike)
        if flipped >= _SAME and flipped > _SAME_SHARE * len(alike):
            yield (
                f"{task.name}: of {len(alike):,} pairs whose frames are the same in both "
                f"worlds, {flipped:,} have two replies; nothing that was shown tells them "
                "apart"
            )


@check("pairs one-sided")
def pairs_of_both_worlds(case: Case) -> Iterator[str]:
    """Right answers in one world alone are as many in either world: a coin drew their order: the
    key of one world, given in both."""
    for task in case.shown:
        sides = [
            _is_first_right(task, pair)
            for pair in find_pairs(task.graded)[0]
            if sum(is_right(side, "strict") for side in pair) == 1
        ]
        if sides and scipy.stats.binomtest(sum(sides), len(sides)).pvalue < _CHANCE:
            yield (
                f"{task.name}: of {len(sides):,} pairs with one right answer, {sum(sides):,} "
                "are right in the first world; a coin drew which is first"
            )


@check("pairs and singles")
def pairs_with_singles(case: Case) -> Iterator[str]:
    """Who answers nearly all single questions from the frames tells some worlds apart: four of five
    answers read off the frames, and no world told from its twin."""
    for plain, twins in _together(case):
        singles = clustered_rate(
            [it.payload.scores.get("strict", 0.0) for it in plain.graded],
            [it.cluster for it in plain.graded],
        )
        pairs = summarise_pairs(twins.graded, "strict")
        if singles is None or pairs is None or pairs.n_pairs < _LEAST_PAIRS:
            continue
        if singles.mean >= _SINGLES and pairs.net_pairs.mean < _PAIRS:
            yield (
                f"{plain.name}: {100 * singles.mean:.1f} % of single answers, and "
                f"{100 * pairs.net_pairs.mean:.1f} % net pairs of {twins.name}, in the same "
                "context; one of the two was not answered from frames"
            )


def _together(case: Case) -> Iterator[tuple[Expected, Expected]]:
    """Yield tasks of single questions with tasks of twins in the same context."""
    for plain in case.shown:
        for twins in case.shown:
            has_pairs = any(unit.payload.twin for unit in twins.units.values())
            is_plain = not any(unit.payload.twin for unit in plain.units.values())
            if is_plain and has_pairs and plain.stated.context == twins.stated.context:
                yield plain, twins


def _is_alike(pair: TwinRecords) -> bool:
    return all(side.twin.n_differing == 0 for side in pair) and not any(
        side.record.payload.recall for side in pair
    )


def _is_first_right(task: Expected, pair: TwinRecords) -> bool:
    worlds = task.graded_data.twins[pair[0].twin.traj_id].traj_ids
    right = pair[0] if is_right(pair[0], "strict") else pair[1]
    return right.twin.traj_id == worlds[0]


@check("above blind")
def not_above_blind(case: Case) -> Iterator[str]:
    """The score is above that of `blind`, which sees no frame: a score that is had without a frame
    shows no memory."""
    for task in case.shown:
        if not _is_above_blind(task):
            yield Remark(f"{task.name}: is not above blind, which sees no frame")


def _is_above_blind(task: Expected) -> bool:
    """Return True if the whole interval of the score above blind is above 0."""
    of_task = above_blind(task.graded, "strict")
    return of_task.low is not None and of_task.low > 0


@check("above other home")
def not_above_other_home(case: Case) -> Iterator[str]:
    """The score is above that on another home of the same kind: knowledge of homes looks like
    memory of this one."""
    controls = {it.name: it for it in case.tasks if it.run.header.config.frames == OTHER}
    for task in case.shown:
        control = controls.get(task.name)
        if control is None:
            text = f"{task.name}: no run on another home; send one (--frames {OTHER})"
            yield Remark(text)
        elif not _is_above_control(task, control):
            text = f"{task.name}: is not above the same model's score on another home"
            yield Remark(text)


def _is_above_control(task: Expected, control: Expected) -> bool:
    theirs = {it.key: it.payload.scores.get("strict", 0.0) for it in control.graded}
    shared = [it for it in task.graded if it.key in theirs]
    difference = paired_difference(
        [theirs[it.key] for it in shared],
        [it.payload.scores.get("strict", 0.0) for it in shared],
        [it.cluster for it in shared],
        most=1.0,
    )
    low = difference.estimate.low
    return low is not None and low > 0
