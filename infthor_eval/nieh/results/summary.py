"""The summary of a run of NIEH: a pure function of its journal.

Cache hits are not in it: they differ between a run and the same run resumed. What a memory took is
a field of its own, `took`, which results.json leaves out.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence

import msgspec

from infthor_eval.distances import DISTANCES, LENGTHS, distance_class, length_class
from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig, SkippedSample
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.above_guessing import AboveGuessing, above_guessing
from infthor_eval.nieh.results.answer_form import YesNo, format_failures, yes_no
from infthor_eval.nieh.results.memory_summary import (
    MemorySummary,
    MemoryTimes,
    summarise_memory,
    time_memory,
)
from infthor_eval.nieh.results.pair_summary import PairSummary, summarise_pairs
from infthor_eval.nieh.results.repeat_summary import (
    RepeatSummary,
    by_question,
    mean_record,
    summarise_repeats,
)
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.rates import Rate
from infthor_eval.runs import UnitRecord
from infthor_eval.statistics import bootstrap_interval, clustered_mean

__all__ = [
    "CLUE_COLUMNS",
    "OPEN_ENDED",
    "SHOWN_CLUES",
    "Cell",
    "EvidenceCells",
    "Failure",
    "LengthCell",
    "NiehSummary",
    "Score",
    "SkippedSummary",
    "TaskSummary",
    "is_open_ended",
    "main_metric",
    "primary_metrics",
    "summarise",
]

CLUE_COLUMNS = ("1", "2", ">=3", "total")  # the columns of the paper's Table 4
OPEN_ENDED = "open-ended"  # column of questions whose answer is neither yes, no nor a number

SHOWN_CLUES = ("all", "some", "none")

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
    """Scores of n samples by metric (empty if n is 0); where the model failed, it is wrong."""

    n: int
    n_failed: int
    scores: dict[str, Score]


class EvidenceCells(msgspec.Struct, frozen=True):
    """Scores by what was shown of the evidence; samples where that is unknown are in no cell.

    Attributes:
        by_shown_clues: cells of the samples with all, some and none of their clue frames shown.
        by_distance: cells by the number of frames between the last clue and the end of the
            trajectory ("50-99").
    """

    by_shown_clues: dict[str, Cell]
    by_distance: dict[str, Cell]


class LengthCell(msgspec.Struct, frozen=True):
    """Scores of samples with contexts of about one length, and those above guessing by scorer."""

    cell: Cell
    above_guessing: dict[str, float | None]


class SkippedSummary(msgspec.Struct, frozen=True):
    """Samples that were not asked, by reason; and the mean by metric if they counted as wrong."""

    n: int
    by_reason: dict[str, int]
    mean_counting_them_wrong: dict[str, float | None]


class Failure(msgspec.Struct, frozen=True):
    """A sample on which the model failed, and the reason."""

    question: str
    reason: str


class TaskSummary(msgspec.Struct, frozen=True):
    """The summary of a task with n samples.

    Attributes:
        simulator: simulator that rendered the frames; None if the set does not say.
        by_clues: cells of the columns of Table 4; of absence questions, which are in the total too;
            and of open-ended questions, which are in the other columns too.
        by_file: cells by question file, in a set of several.
        evidence: cells by what was shown of the evidence: of all samples ("total"), and of each
            file.
        by_length: cells by thousand tokens of the context ("32-64").
        above_guessing: the share of what cannot be guessed that the replies got, by scorer.
        format_failures: number of replies that are not of the form asked for, by reason.
        n_thought: number of replies behind thoughts.
        tokens_per_right: tokens of all replies, thoughts included, for each right answer under the
            main metric; None if none is right or the model counts no tokens.
        below_full_marks: samples with a score below 1, by metric.
        scores: scores by metric and trajectory, in the order of the samples' keys, by which runs
            are paired.
        memory: the memory that recalled what was shown; None if there is none.
        pairs: how pairs of twins were answered under the main metric; None if there are none.
    """

    n: int
    context: str
    simulator: str | None
    metrics: list[str]
    by_clues: dict[str, Cell]
    by_question_type: dict[str, Cell]
    by_variant: dict[str, Cell]
    by_file: dict[str, Cell]
    evidence: dict[str, EvidenceCells]
    by_length: dict[str, LengthCell]
    above_guessing: dict[str, AboveGuessing]
    skipped: SkippedSummary
    yes_no: YesNo
    format_failures: dict[str, int]
    n_thought: int
    tokens_per_right: float | None
    below_full_marks: dict[str, list[str]]
    scores: dict[str, dict[str, list[float]]]
    failures: list[Failure]
    memory: MemorySummary | None = None
    pairs: PairSummary | None = None


class NiehSummary(msgspec.Struct, frozen=True, omit_defaults=True):
    """The summary of a run by task.

    Attributes:
        tasks: summaries over questions. Where answers were repeated, each question counts with its
            mean scores; replies are counted in `yes_no`, `format_failures` and `failures` alone.
        took: what their memories took, which differs from run to run.
        repeats: how the repeated answers to their questions compare.
    """

    tasks: dict[str, TaskSummary]
    took: dict[str, MemoryTimes] = {}
    repeats: dict[str, RepeatSummary] = {}


def summarise(config: NiehConfig, records: Sequence[Record]) -> NiehSummary:
    """Summarise the run of a config by the records of its units; their order does not matter."""
    in_order = sorted(records, key=lambda record: record.key)
    tasks: dict[str, TaskSummary] = {}
    took: dict[str, MemoryTimes] = {}
    repeats: dict[str, RepeatSummary] = {}
    for name, task in config.tasks.items():
        replies = [record for record in in_order if record.task == name]
        tasks[name] = _task(replies, task, config)
        times = time_memory(replies)
        if times is not None:
            took[name] = times
        compared = summarise_repeats(by_question(replies), _main_metric(task.metrics.names))
        if compared is not None:
            repeats[name] = compared
    return NiehSummary(tasks, took, repeats)


def main_metric(task: TaskSummary) -> str:
    """Return the main metric of a task: the strict scorer, else the first of its own."""
    return _main_metric(task.metrics)


def _main_metric(metrics: Sequence[str]) -> str:
    return "strict" if "strict" in metrics else metrics[0]


def primary_metrics(summary: NiehSummary) -> dict[str, Rate]:
    """Return the main metric of each task with any sample: of twins the pairs', else the mean."""
    rates = {}
    for name, task in summary.tasks.items():
        if task.pairs is not None:
            rates[name] = task.pairs.pair_accuracy
            continue
        total = task.by_clues["total"]
        if total.n:
            score = total.scores[main_metric(task)]
            rates[name] = Rate(score.mean, score.low, score.high, total.n)
    return rates


def _task(replies: Sequence[Record], task: NiehTaskConfig, config: NiehConfig) -> TaskSummary:
    metrics = list(task.metrics.names)
    records = [mean_record(same) for same in by_question(replies)]
    files = _by_file(records)
    return TaskSummary(
        n=len(records),
        context=task.context,
        simulator=task.simulator,
        metrics=metrics,
        by_clues=_by_clues(records, metrics),
        by_question_type=_group(records, metrics, _question_type),
        by_variant=_group(records, metrics, lambda record: record.variant or "-"),
        by_file={name: _cell(chosen, metrics) for name, chosen in files.items()},
        evidence={
            name: _evidence(chosen, metrics) for name, chosen in {"total": records, **files}.items()
        },
        by_length=_by_length(records, metrics),
        above_guessing=_above_guessing(records, metrics),
        skipped=_summarise_skipped(records, metrics, task.skipped),
        yes_no=yes_no(replies),
        format_failures=format_failures(replies, task.decoding["max_new_tokens"]),
        n_thought=sum(record.payload.thinking is not None for record in replies),
        tokens_per_right=_tokens_per_right(replies, _main_metric(metrics)),
        below_full_marks={name: _below_full_marks(records, name) for name in metrics},
        scores={name: _by_trajectory(records, name) for name in metrics},
        failures=_failures(replies),
        memory=summarise_memory(config, task, records),
        pairs=summarise_pairs(replies, _main_metric(metrics)),
    )


def _by_file(records: Sequence[Record]) -> dict[str, list[Record]]:
    """Return the records by question file, in the order of the files' names."""
    files: dict[str, list[Record]] = {}
    for record in records:
        if record.payload.file:
            files.setdefault(record.payload.file, []).append(record)
    return dict(sorted(files.items()))


def _question_type(record: Record) -> str:
    return record.payload.question_type or "untyped"


def _below_full_marks(records: Sequence[Record], metric: str) -> list[str]:
    return [str(record.key) for record in records if _score(record, metric) < 1.0]


def _failures(replies: Sequence[Record]) -> list[Failure]:
    return [
        Failure(str(record.key), record.failure) for record in replies if record.failure is not None
    ]


def _tokens_per_right(replies: Sequence[Record], metric: str) -> float | None:
    counts = [record.tokens.reply for record in replies if record.tokens.reply is not None]
    right = _sum(replies, metric)
    return sum(counts) / right if counts and right else None


def _score(record: Record, metric: str) -> float:
    return record.payload.scores.get(metric, 0.0)  # 0 if the model failed


def _sum(records: Sequence[Record], metric: str) -> float:
    return math.fsum(_score(record, metric) for record in records)


def _by_trajectory(records: Sequence[Record], metric: str) -> dict[str, list[float]]:
    scores: dict[str, list[float]] = {}
    for record in records:
        scores.setdefault(record.cluster, []).append(_score(record, metric))
    return scores


def _by_clues(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, Cell]:
    columns: dict[str, list[Record]] = {name: [] for name in (*CLUE_COLUMNS, ABSENCE)}
    for record in records:
        if record.payload.clue_column in columns:
            columns[record.payload.clue_column].append(record)
    columns["total"] = list(records)
    columns[OPEN_ENDED] = [record for record in records if is_open_ended(record)]
    return {name: _cell(chosen, metrics) for name, chosen in columns.items()}


def is_open_ended(record: Record) -> bool:
    """Return the published test: the first gold answer decides, a number in quotes is a text."""
    first = record.payload.answers[0]
    return isinstance(first, str) and first.strip().lower() not in ("yes", "no")


def _group(
    records: Sequence[Record], metrics: Sequence[str], name_of: Callable[[Record], str]
) -> dict[str, Cell]:
    groups: dict[str, list[Record]] = {}
    for record in records:
        groups.setdefault(name_of(record), []).append(record)
    return {name: _cell(chosen, metrics) for name, chosen in sorted(groups.items())}


def _evidence(records: Sequence[Record], metrics: Sequence[str]) -> EvidenceCells:
    return EvidenceCells(
        by_shown_clues=_in_order(records, metrics, _share_shown, SHOWN_CLUES),
        by_distance=_in_order(records, metrics, _distance, DISTANCES),
    )


def _in_order(
    records: Sequence[Record],
    metrics: Sequence[str],
    name_of: Callable[[Record], str | None],
    names: Sequence[str],
) -> dict[str, Cell]:
    """Return the cells of groups with samples, in their names' order; some samples are in none."""
    cells = {}
    for name in names:
        chosen = [record for record in records if name_of(record) == name]
        if chosen:
            cells[name] = _cell(chosen, metrics)
    return cells


def _by_length(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, LengthCell]:
    cells = {}
    for name, cell in _in_order(records, metrics, _length, LENGTHS).items():
        chosen = [record for record in records if _length(record) == name]
        shares = _above_guessing(chosen, metrics)
        cells[name] = LengthCell(cell, {metric: share.mean for metric, share in shares.items()})
    return cells


def _above_guessing(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, AboveGuessing]:
    return {name: above_guessing(records, name) for name in metrics if name in SCORERS}


def _share_shown(record: Record) -> str | None:
    clues = record.payload.shown_clues
    if clues is None:
        return None
    return SHOWN_CLUES[0 if clues.n_shown == clues.n_clues else 1 if clues.n_shown else 2]


def _distance(record: Record) -> str | None:
    clues = record.payload.shown_clues
    return None if clues is None or clues.n_after is None else distance_class(clues.n_after)


def _length(record: Record) -> str | None:
    tokens = record.tokens.context
    return None if tokens is None else length_class(tokens)


def _cell(records: Sequence[Record], metrics: Sequence[str]) -> Cell:
    scores = {name: _mean(records, name) for name in metrics} if records else {}
    return Cell(len(records), sum(record.failure is not None for record in records), scores)


def _mean(records: Sequence[Record], metric: str) -> Score:
    scores = [_score(record, metric) for record in records]
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


def _summarise_skipped(
    records: Sequence[Record], metrics: Sequence[str], skipped: Sequence[SkippedSample]
) -> SkippedSummary:
    n = len(records) + len(skipped)
    means = {name: _sum(records, name) / n if n else None for name in metrics}
    reasons = Counter(sample.reason for sample in skipped)
    return SkippedSummary(len(skipped), dict(sorted(reasons.items())), means)
