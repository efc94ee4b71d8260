"""The share of what could not be guessed that a run got: 0 for a guesser, 1 for all right.

Of a form of questions with the score s and the guess g it is (s - g) / (1 - g); forms are pooled by
their questions. That equals the mean over questions of (their score - their guess) / (1 - g), so it
has intervals, and runs can be paired. A form that is in two files counts as two.
docs/reference/metrics.md says what it assumes.
"""

from collections.abc import Sequence

import msgspec

from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import bootstrap_interval

__all__ = [
    "SOLVED",
    "AboveGuessing",
    "FormScore",
    "above_guessing",
    "score_above_guessing",
    "score_range",
]

# A form with a better guess counts as solved by guessing: what is left of it is a few questions,
# and a run that errs on one of them more than the guesser would lose more than it could win on all
# others.
SOLVED = 0.95


class FormScore(msgspec.Struct, frozen=True):
    """A form's questions: their number, the run's mean score, and the best guesser's mean."""

    n: int
    score: float
    guess: float


class AboveGuessing(msgspec.Struct, frozen=True):
    """The score above guessing of n questions, at most 1; None if there is none.

    Attributes:
        low: lower end of the 95 % interval over resampled trajectories; None with fewer than two.
        high: its upper end.
        n: number of questions that count.
        n_solved: number of questions that do not, as guessing solves their form.
        n_unknown: number of questions whose guess is not known.
        forms: all forms with a guess.
        solved_forms: those that guessing solves.
    """

    mean: float | None
    low: float | None
    high: float | None
    n: int
    n_solved: int
    n_unknown: int
    forms: dict[str, FormScore]
    solved_forms: list[str]


def score_above_guessing(payload: NiehAnswer, scorer: str) -> float | None:
    """Return what an answered question adds to the mean above guessing; None if it does not
    count."""
    guess = payload.guess
    if guess is None or scorer not in guess.form_scores or guess.form_scores[scorer] > SOLVED:
        return None
    if payload.scores and scorer not in payload.scores:  # the task has not this scorer
        return None
    return (payload.scores.get(scorer, 0.0) - guess.scores[scorer]) / (
        1 - guess.form_scores[scorer]
    )


def above_guessing(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> AboveGuessing:
    """Return the score above guessing of some answered questions under a scorer."""
    known = [
        record
        for record in records
        if record.payload.guess and scorer in record.payload.guess.scores
    ]
    pairs = [(score_above_guessing(record.payload, scorer), record.cluster) for record in known]
    counted = [(score, cluster) for score, cluster in pairs if score is not None]
    scores = [score for score, _ in counted]
    clusters = [cluster for _, cluster in counted]
    mean = sum(scores) / len(scores) if scores else None
    low, high = _interval(scores, clusters, [it for it in known if _counts(it, scorer)], scorer)
    return AboveGuessing(
        mean=mean,
        low=low,
        high=high,
        n=len(scores),
        n_solved=len(known) - len(scores),
        n_unknown=len(records) - len(known),
        forms=_by_form(known, scorer),
        solved_forms=sorted(
            {
                _form(record)
                for record in known
                if score_above_guessing(record.payload, scorer) is None
            }
        ),
    )


def _counts(record: UnitRecord[NiehAnswer], scorer: str) -> bool:
    return score_above_guessing(record.payload, scorer) is not None


def _interval(
    scores: Sequence[float],
    clusters: Sequence[str],
    records: Sequence[UnitRecord[NiehAnswer]],
    scorer: str,
) -> tuple[float, float] | tuple[None, None]:
    """Return the interval over resampled trajectories, cut off where all are right, or wrong.

    A question on which the guess is wrong adds more than 1 if it is right, so a sample of such ones
    would exceed 1.
    """
    found = bootstrap_interval(scores, clusters) if scores else None
    if found is None:
        return None, None
    lowest, highest = score_range(records, scorer)
    mean = sum(scores) / len(scores)
    return min(mean, max(found[0], lowest)), max(mean, min(found[1], highest))


def score_range(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> tuple[float, float]:
    """Return the score above guessing of questions that count if all are wrong, and if all are
    right."""
    ends = []
    for right in (0.0, 1.0):
        payloads = (
            msgspec.structs.replace(record.payload, scores={scorer: right}) for record in records
        )
        ends.append(
            sum(score_above_guessing(payload, scorer) or 0.0 for payload in payloads) / len(records)
        )
    return ends[0], ends[1]


def _by_form(records: Sequence[UnitRecord[NiehAnswer]], scorer: str) -> dict[str, FormScore]:
    by_form: dict[str, list[tuple[float, float]]] = {}
    for record in records:
        assert record.payload.guess is not None
        pair = record.payload.scores.get(scorer, 0.0), record.payload.guess.scores[scorer]
        by_form.setdefault(_form(record), []).append(pair)
    scores = {}
    for form, pairs in sorted(by_form.items()):
        replied, guessed = zip(*pairs, strict=True)
        scores[form] = FormScore(len(pairs), sum(replied) / len(pairs), sum(guessed) / len(pairs))
    return scores


def _form(record: UnitRecord[NiehAnswer]) -> str:
    assert record.payload.guess is not None
    file = record.payload.file
    form = record.payload.guess.form
    return f"{file}: {form}" if file else form
