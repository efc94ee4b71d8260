"""Repeated answers: the mean of each question, and how far the answers of one question agree.

Summaries are over questions, so a question that was asked N times counts once, with its mean
scores. What a set of other trajectories would change and what another drawing would change are two
things: the intervals of all tables are over trajectories, `drawing` is of the drawing alone.
"""

import math
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from statistics import fmean, variance

import msgspec

from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import compared_form
from infthor_eval.runs import UnitRecord

_NORMAL_95 = 1.96

Record = UnitRecord[NiehAnswer]


class RepeatSummary(msgspec.Struct, frozen=True):
    """How the repeated answers to the questions of a task compare, under its main metric.

    Attributes:
        n_repeats: times that each question was asked.
        n_questions: number of questions with an answer; the answers that a question has count.
        mean: mean score of all answers.
        drawing: half the width of the 95 % interval of the mean over other drawings of answers to
            the same questions.
        consensus: mean score of each question's commonest answer, the first of equals.
        agreement: mean share of a question's answers that say the same as the commonest.
        always: share of the questions that every answer got right, with full marks.
        sometimes: share that some answers got right and others not.
        never: share that none got right.
        variance_within: mean variance of the scores of one question.
        variance_between: variance of the questions' true means: that of the observed means without
            what drawing adds.
    """

    n_repeats: int
    n_questions: int
    mean: float
    drawing: float
    consensus: float
    agreement: float
    always: float
    sometimes: float
    never: float
    variance_within: float
    variance_between: float


def by_question(records: Sequence[Record]) -> list[list[Record]]:
    """Return the records of each question in its variant, given records in key order."""
    return [list(same) for _, same in groupby(records, key=lambda record: record.key.once)]


def mean_record(records: Sequence[Record]) -> Record:
    """Return a record of a question's answers, with their mean scores; the first failed one, or
    else the first, if there is no answer."""
    answered = _answered(records)
    if not answered:
        return next((record for record in records if record.state == "failed"), records[0])
    if len(records) == 1:
        return records[0]
    names = {name for record in answered for name in record.payload.scores}
    scores = {name: fmean(_scores(answered, name)) for name in sorted(names)}
    payload = msgspec.structs.replace(answered[0].payload, scores=scores)
    return msgspec.structs.replace(answered[0], payload=payload)


def _answered(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if record.state == "answered"]


def _scores(records: Sequence[Record], metric: str) -> list[float]:
    return [record.payload.scores.get(metric, 0.0) for record in records]


def summarise_repeats(questions: Sequence[Sequence[Record]], metric: str) -> RepeatSummary | None:
    """Return how a task's repeated answers compare under a metric; None if nothing was repeated."""
    n_repeats = max(map(len, questions), default=0)
    questions = [answered for same in questions if (answered := _answered(same))]
    if n_repeats < 2 or not questions:
        return None
    means: list[float] = []
    within: list[float] = []
    noise: list[float] = []
    shares_right: list[float] = []
    for same in questions:
        scores = _scores(same, metric)
        means.append(fmean(scores))
        within.append(variance(scores) if len(scores) > 1 else 0.0)
        noise.append(within[-1] / len(scores))
        shares_right.append(sum(score >= 1 for score in scores) / len(scores))
    votes = [_vote(same, metric) for same in questions]
    return RepeatSummary(
        n_repeats=n_repeats,
        n_questions=len(questions),
        mean=fmean(means),
        drawing=_NORMAL_95 * math.sqrt(sum(noise)) / len(questions),
        consensus=fmean(score for score, _ in votes),
        agreement=fmean(share for _, share in votes),
        always=fmean(share == 1 for share in shares_right),
        sometimes=fmean(0 < share < 1 for share in shares_right),
        never=fmean(share == 0 for share in shares_right),
        variance_within=fmean(within),
        variance_between=max(0.0, variance(means) - fmean(noise)) if len(means) > 1 else 0.0,
    )


def _vote(records: Sequence[Record], metric: str) -> tuple[float, float]:
    """Return the commonest answer's score and share of the answers."""
    payloads = [record.payload for record in records]
    answers = [compared_form(payload.reply or "", payload.answers) for payload in payloads]
    counts = Counter(answers)
    # The first of equals: counters keep the order.
    text, count = max(counts.items(), key=lambda counted: counted[1])
    return records[answers.index(text)].payload.scores.get(metric, 0.0), count / len(records)
