"""The share of what `blind` has not that a run got: 0 for `blind`, 1 for all right.

Of a form of questions with the score s, and b of `blind`, it is (s - b) / (1 - b); forms are
pooled by their questions. That equals the mean over questions of (their score - that of `blind`)
/ (1 - b), so it has intervals, and runs can be paired. A form that is in two files counts as two.
docs/reference/metrics.md says what it assumes.
"""

from collections.abc import Sequence

import msgspec

from infthor_eval.grouping import grouped
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import bootstrap_interval

# A form of which `blind` has more counts as solved by it: what is left is a few questions, and a
# run that errs on one of them more than `blind` would lose more than it could win on all others.
SOLVED = 0.95


class FormScore(msgspec.Struct, frozen=True):
    """A form's questions: their number, the run's mean score, and that of `blind`."""

    n: int
    score: float
    blind: float


class AboveBlind(msgspec.Struct, frozen=True):
    """The score above blind of n questions, at most 1; None if there is none.

    Attributes:
        low: lower end of the 95 % interval over resampled trajectories; None with fewer than two.
        high: its upper end.
        n: number of questions that count.
        n_solved: number of questions that do not, as `blind` solves their form.
        n_unknown: number of questions to which it is not known what `blind` says.
        forms: all forms for which that is known.
        solved_forms: those that `blind` solves.
    """

    mean: float | None
    low: float | None
    high: float | None
    n: int
    n_solved: int
    n_unknown: int
    forms: dict[str, FormScore]
    solved_forms: list[str]


def score_above_blind(payload: NiehAnswer, scorer: str) -> float | None:
    """Return what an answered question adds to the mean above blind; None if it does not
    count."""
    blind = payload.blind
    if blind is None or scorer not in blind.form_scores or blind.form_scores[scorer] > SOLVED:
        return None
    if payload.scores and scorer not in payload.scores:  # the task has not this scorer
        return None
    return (payload.scores.get(scorer, 0.0) - blind.scores[scorer]) / (
        1 - blind.form_scores[scorer]
    )


def above_blind(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> AboveBlind:
    """Return the score above blind of some answered questions under a scorer."""
    known = [it for it in records if it.payload.blind and scorer in it.payload.blind.scores]
    found = [(it, score_above_blind(it.payload, scorer)) for it in known]
    counted = [(it, score) for it, score in found if score is not None]
    mean = sum(score for _, score in counted) / len(counted) if counted else None
    low, high = _interval(counted, scorer)
    return AboveBlind(
        mean=mean,
        low=low,
        high=high,
        n=len(counted),
        n_solved=len(known) - len(counted),
        n_unknown=len(records) - len(known),
        forms=_by_form(known, scorer),
        solved_forms=sorted({_form(it) for it, score in found if score is None}),
    )


def _interval(
    counted: Sequence[tuple[UnitRecord[NiehAnswer], float]], scorer: str
) -> tuple[float, float] | tuple[None, None]:
    """Return the interval over resampled trajectories, cut off where all are right, or wrong.

    A question on which `blind` is wrong adds more than 1 if it is right, so a sample of such ones
    would exceed 1.
    """
    records = [it for it, _ in counted]
    scores = [score for _, score in counted]
    found = bootstrap_interval(scores, [it.cluster for it in records]) if scores else None
    if found is None:
        return None, None
    lowest, highest = score_range(records, scorer)
    mean = sum(scores) / len(scores)
    return min(mean, max(found[0], lowest)), max(mean, min(found[1], highest))


def score_range(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> tuple[float, float]:
    """Return the score above blind of questions that count if all are wrong, and if all are
    right."""
    ends = []
    for right in (0.0, 1.0):
        payloads = (
            msgspec.structs.replace(record.payload, scores={scorer: right}) for record in records
        )
        ends.append(
            sum(score_above_blind(payload, scorer) or 0.0 for payload in payloads) / len(records)
        )
    return ends[0], ends[1]


def _by_form(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> dict[str, FormScore]:
    scores = {}
    for form, same in sorted(grouped((_form(record), record) for record in records).items()):
        replied = sum(record.payload.scores.get(scorer, 0.0) for record in same)
        blind = sum(record.payload.blind.scores[scorer] for record in same if record.payload.blind)
        scores[form] = FormScore(len(same), replied / len(same), blind / len(same))
    return scores


def _form(record: UnitRecord[NiehAnswer]) -> str:
    assert record.payload.blind is not None
    file = record.payload.file
    form = record.payload.blind.form
    return f"{file}: {form}" if file else form
