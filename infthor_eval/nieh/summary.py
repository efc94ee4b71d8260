"""What a run of NIEH found: a pure function of its journal.

Times and cache hits are not in it: they differ between a run and the same run resumed.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from infthor_eval.formats.question import ABSENCE, clue_column
from infthor_eval.nieh.answer_form import YesNo, format_failures, yes_no
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.rates import Rate
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import bootstrap_interval, clustered_mean

__all__ = [
    "CLUE_COLUMNS",
    "OPEN_ENDED",
    "Cell",
    "Failure",
    "NiehSummary",
    "Score",
    "SkippedSummary",
    "TaskSummary",
    "main_metric",
    "primary_metrics",
    "summarise",
]

CLUE_COLUMNS = ("1", "2", ">=3", "total")  # the columns of the paper's Table 4
OPEN_ENDED = "open-ended"  # the column of questions to which the answer is neither yes, no nor a number, as published

Record = UnitRecord[NiehAnswer]


class Score(msgspec.Struct, frozen=True):
    """A mean score under one metric.

    Attributes:
        mean: from 0 to 1; the reference scorer can exceed 1 where a reply repeats itself.
        stderr: clustered by trajectory; None with fewer than two trajectories.
        low: lower end of the 95 % interval; None as above.
        high: upper end.
        bootstrap: 95 % interval over resampled trajectories; None as above, and where all scores are alike.
        n_trajectories: number of clusters.
    """

    mean: float
    stderr: float | None
    low: float | None
    high: float | None
    bootstrap: tuple[float, float] | None
    n_trajectories: int


class Cell(msgspec.Struct, frozen=True):
    """Some samples.

    Attributes:
        n: samples asked; a failed one counts as wrong.
        n_failed: samples that the model could not answer.
        scores: by metric; empty where no sample was asked.
    """

    n: int
    n_failed: int
    scores: dict[str, Score]


class SkippedSummary(msgspec.Struct, frozen=True):
    """What was not asked.

    Attributes:
        n: how many samples.
        by_reason: how many for each reason.
        mean_counting_them_wrong: by metric, the mean with them counted as wrong: the other denominator.
    """

    n: int
    by_reason: dict[str, int]
    mean_counting_them_wrong: dict[str, float | None]


class Failure(msgspec.Struct, frozen=True):
    """A sample that the model failed on, and why."""

    question: str
    reason: str


class TaskSummary(msgspec.Struct, frozen=True):
    """One task.

    Attributes:
        n: samples asked.
        context: the context that they were asked in.
        simulator: what rendered the frames; None where the set does not say.
        metrics: names of the metrics.
        by_clues: by the columns of Table 4; of absence questions: apart from those with clues, and in the total; and of
            open-ended questions, which are in the others too.
        by_question_type: by type.
        by_variant: by way of asking.
        skipped: what was not asked.
        yes_no: leaning to yes.
        format_failures: replies that are not of the form asked for, by reason.
        below_full_marks: by metric, which samples fell short of 1.
        scores: by metric and trajectory, of every sample in the order of their keys: what runs are paired by.
        failures: which samples failed.
    """

    n: int
    context: str
    simulator: str | None
    metrics: list[str]
    by_clues: dict[str, Cell]
    by_question_type: dict[str, Cell]
    by_variant: dict[str, Cell]
    skipped: SkippedSummary
    yes_no: YesNo
    format_failures: dict[str, int]
    below_full_marks: dict[str, list[str]]
    scores: dict[str, dict[str, list[float]]]
    failures: list[Failure]


class NiehSummary(msgspec.Struct, frozen=True):
    """A whole run.

    Attributes:
        tasks: by name.
    """

    tasks: dict[str, TaskSummary]


def summarise(identity: Mapping[str, Any], records: Sequence[Record]) -> NiehSummary:
    """Everything that a run found; the same records give the same summary, in whatever order.

    Args:
        identity: of the run.
        records: of its units, each once.
    """
    kept = sorted(records, key=lambda record: record.key)
    tasks = identity["tasks"].items()
    return NiehSummary({task: _task([r for r in kept if r.task == task], about) for task, about in tasks})


def main_metric(task: TaskSummary) -> str:
    """The metric that a task is known by: the strict scorer, else the first of its own."""
    return "strict" if "strict" in task.metrics else task.metrics[0]


def primary_metrics(summary: NiehSummary) -> dict[str, Rate]:
    """The mean of all samples of each task that asked any, under its main metric."""
    totals = {name: (task.by_clues["total"], main_metric(task)) for name, task in summary.tasks.items()}
    scores = {name: (cell.scores[metric], cell.n) for name, (cell, metric) in totals.items() if cell.n}
    return {name: Rate(score.mean, score.low, score.high, n) for name, (score, n) in scores.items()}


def _task(records: Sequence[Record], about: Mapping[str, Any]) -> TaskSummary:
    metrics = list(about["metrics"]["names"])
    return TaskSummary(
        n=len(records),
        context=about["config"]["dataset_kwargs"]["context"],
        simulator=about["simulator"],
        metrics=metrics,
        by_clues=_by_clues(records, metrics),
        by_question_type=_grouped(records, metrics, lambda record: record.payload.question_type or "untyped"),
        by_variant=_grouped(records, metrics, lambda record: record.variant or "-"),
        skipped=_skipped(records, metrics, about["skipped"]),
        yes_no=yes_no(records),
        format_failures=format_failures(records, about["decoding"]["max_new_tokens"]),
        below_full_marks={
            name: [str(record.key) for record in records if _score(record, name) < 1.0] for name in metrics
        },
        scores={name: _by_trajectory(records, name) for name in metrics},
        failures=[Failure(str(record.key), record.failure) for record in records if record.failure is not None],
    )


def _score(record: Record, metric: str) -> float:
    """The score of a recorded reply; 0 where there is none."""
    return record.payload.scores.get(metric, 0.0)


def _by_trajectory(records: Sequence[Record], metric: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for record in records:
        found.setdefault(record.cluster, []).append(_score(record, metric))
    return found


def _by_clues(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, Cell]:
    chosen = {name: [r for r in records if clue_column(r.payload.n_clues) == name] for name in (*CLUE_COLUMNS, ABSENCE)}
    chosen["total"] = list(records)
    chosen[OPEN_ENDED] = [record for record in records if _is_open_ended(record)]
    return {name: _cell(found, metrics) for name, found in chosen.items()}


def _is_open_ended(record: Record) -> bool:
    """The published test: the first gold answer decides, and a number in quotes counts as a text."""
    first = record.payload.answers[0]
    return isinstance(first, str) and first.strip().lower() not in ("yes", "no")


def _grouped(records: Sequence[Record], metrics: Sequence[str], name_of: Callable[[Record], str]) -> dict[str, Cell]:
    names = sorted({name_of(record) for record in records})
    return {name: _cell([r for r in records if name_of(r) == name], metrics) for name in names}


def _cell(records: Sequence[Record], metrics: Sequence[str]) -> Cell:
    scores = {name: _mean(records, name) for name in metrics} if records else {}
    return Cell(len(records), sum(record.failure is not None for record in records), scores)


def _mean(records: Sequence[Record], metric: str) -> Score:
    found, trajectories = [_score(record, metric) for record in records], [record.cluster for record in records]
    estimate = clustered_mean(found, trajectories)
    return Score(
        mean=estimate.mean,
        stderr=estimate.stderr,
        low=estimate.low,
        high=estimate.high,
        bootstrap=bootstrap_interval(found, trajectories),
        n_trajectories=estimate.n_clusters,
    )


def _skipped(records: Sequence[Record], metrics: Sequence[str], skipped: Sequence[Mapping[str, str]]) -> SkippedSummary:
    n = len(records) + len(skipped)
    means = {name: math.fsum(_score(record, name) for record in records) / n if n else None for name in metrics}
    reasons = Counter(item["reason"] for item in skipped)
    return SkippedSummary(len(skipped), dict(sorted(reasons.items())), means)
