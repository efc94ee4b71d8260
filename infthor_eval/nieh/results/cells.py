"""Scores of groups of samples: the means over those that were answered, and how many these are."""

from collections import Counter
from collections.abc import Sequence

import msgspec

from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import bootstrap_interval, clustered_mean
from infthor_eval.tables import TableCell, answered_cell, interval_cell

Record = UnitRecord[NiehAnswer]


class Score(msgspec.Struct, frozen=True):
    """A mean score under a metric, 0 to 1; the reference scorer exceeds 1 on repetitions.

    Standard error and 95 % intervals are by trajectory, and None with fewer than two. `bootstrap`
    is the interval over resampled trajectories; None also if all scores are equal.
    """

    mean: float
    stderr: float | None
    low: float | None
    high: float | None
    bootstrap: tuple[float, float] | None
    n_trajectories: int


class Cell(msgspec.Struct, frozen=True):
    """Scores of samples by metric, over those that were answered; empty if none was.

    Attributes:
        n: number of samples. Those that a stopped run did not come to are in a task's total alone.
        n_failed: number of those whose request failed.
        n_not_asked: number of those that were not asked.
    """

    n: int
    n_failed: int
    scores: dict[str, Score]
    n_not_asked: int = 0

    @property
    def n_answered(self) -> int:
        """Number of samples with a reply, which the scores are over."""
        return self.n - self.n_failed - self.n_not_asked


def make_cell(records: Sequence[Record], metrics: Sequence[str]) -> Cell:
    """Return the cell of a group of samples that a run has records of."""
    states = Counter(record.state for record in records)
    answered = [record for record in records if record.state == "answered"]
    scores = {name: _mean(answered, name) for name in metrics} if answered else {}
    return Cell(len(records), states["failed"], scores, states["not asked"])


def _mean(records: Sequence[Record], metric: str) -> Score:
    scores = [score_of(record, metric) for record in records]
    trajectories = [record.cluster for record in records]
    estimate = clustered_mean(scores, trajectories)
    return Score(
        mean=estimate.mean,
        stderr=estimate.stderr,
        low=estimate.low,
        high=estimate.high,
        bootstrap=bootstrap_interval(scores, trajectories),
        n_trajectories=estimate.n_clusters,
    )


def with_missing(cell: Cell, n_missing: int) -> Cell:
    """Return a cell with samples that a stopped run did not come to."""
    return msgspec.structs.replace(
        cell, n=cell.n + n_missing, n_not_asked=cell.n_not_asked + n_missing
    )


def score_of(record: Record, metric: str) -> float:
    """Return the score of a sample; 0 without an answer."""
    return record.payload.scores.get(metric, 0.0)


def percent(share: float | None, n_digits: int = 1) -> str:
    """Return a share in percent; `-` if there is none."""
    return "-" if share is None else f"{100 * share:.{n_digits}f}"


def mean_cell(cell: Cell | None, metric: str, n_digits: int = 2) -> TableCell:
    """Return a mean in percent, with the number of answers if not all samples have one; `-` if
    there are no samples."""
    if cell is None or not cell.n:
        return TableCell("-", {"": ""})
    score = cell.scores.get(metric)
    mean = "" if score is None else f"{100 * score.mean:.{n_digits}f}"
    return answered_cell(mean, cell.n_answered, cell.n)


def both_intervals(cell: Cell, metric: str) -> tuple[TableCell, TableCell]:
    """Return the clustered interval of a mean in percent, and that by resampling; `-` for one that
    there is not, as of a single trajectory."""
    score = cell.scores.get(metric)
    resampled = None if score is None else score.bootstrap
    low, high = (None, None) if resampled is None else (100 * end for end in resampled)
    return score_interval(cell, metric, "{}–{}"), interval_cell(low, high, pattern="{}–{}")


def score_interval(cell: Cell, metric: str, pattern: str = "[{}, {}]") -> TableCell:
    """Return the interval of a mean in percent; `-` if there is none."""
    score = cell.scores.get(metric)
    if score is None or score.low is None or score.high is None:
        return interval_cell(None, None)
    return interval_cell(100 * score.low, 100 * score.high, pattern=pattern)
