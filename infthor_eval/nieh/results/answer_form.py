"""The form of replies, right or wrong: a leaning to yes, and replies that are no answer at all."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import msgspec

from infthor_eval.nieh.numbers import number_in, number_of
from infthor_eval.nieh.prompts import last_line
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import says_yes_or_no
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]

_REPEATED = "repeats the question"
_CUT_OFF = "cut off while thinking"


class YesNo(msgspec.Struct, frozen=True):
    """Yes/no questions with an answer; the shares, 0 to 1, are None without any.

    Attributes:
        n_neither: replies that are neither, or both.
    """

    n: int
    share_gold_yes: float | None
    share_said_yes: float | None
    n_neither: int


def yes_no(records: Sequence[Record]) -> YesNo:
    """Return the bias on a task's yes/no questions: is it always yes, or neither?"""
    binary = [
        record
        for record in records
        if record.state == "answered" and _gold(record) in ({"yes"}, {"no"})
    ]
    answers = Counter(says_yes_or_no(last_line(record.payload.reply or "")) for record in binary)
    n = len(binary)
    return YesNo(
        n=n,
        share_gold_yes=sum(_gold(record) == {"yes"} for record in binary) / n if n else None,
        share_said_yes=answers["yes"] / n if n else None,
        n_neither=answers[None],
    )


def format_failures(records: Sequence[Record], max_new_tokens: int | None) -> dict[str, int]:
    """Count replies not of the form asked for, by reason; one with two faults counts twice."""
    counts: Counter[str] = Counter()
    for record in records:
        if record.payload.reply is not None:
            counts.update(_failures(record, last_line(record.payload.reply), max_new_tokens))
    return dict(sorted(counts.items()))


def _failures(record: Record, response: str, max_new_tokens: int | None) -> list[str]:
    gold = _gold(record)
    reasons = []
    if not response:
        reasons.append("empty" if record.payload.thinking is None else _CUT_OFF)
    elif gold in ({"yes"}, {"no"}) and says_yes_or_no(response) is None:
        reasons.append("neither yes nor no")
    elif len(gold) == 1 and number_of(next(iter(gold))) is not None and number_in(response) is None:
        reasons.append("no number")
    is_cut_thinking = not response and record.payload.thinking is not None
    if (
        not is_cut_thinking
        and max_new_tokens is not None
        and (record.tokens.reply or 0) >= max_new_tokens
    ):
        reasons.append("cut off at the token limit")
    question = record.payload.question
    if question and question in (record.payload.reply or ""):
        reasons.append(_REPEATED)
    return reasons


def form_notes(failures: Mapping[str, int], n_answered: int) -> Iterator[str]:
    """Yield a remark if most replies repeat their question, as behind a server that gives the
    prompt back, and one if any ends before its answer; `failures` are of `format_failures`."""
    n_repeated = failures.get(_REPEATED, 0)
    if n_repeated > n_answered / 2:
        yield (
            f"{n_repeated:,} of {n_answered:,} replies repeat their question, and are scored so. "
            "Does the server give the prompt back with the reply?"
        )
    if _CUT_OFF in failures:
        yield (
            f"{failures[_CUT_OFF]:,} replies reached the token limit before any answer, and are "
            "wrong; --max-thinking-tokens N gives more"
        )


def _gold(record: Record) -> set[str]:
    return {str(answer).lower() for answer in record.payload.answers}
