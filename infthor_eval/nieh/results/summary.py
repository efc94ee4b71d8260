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
from infthor_eval.nieh.results.above_blind import AboveBlind, above_blind
from infthor_eval.nieh.results.answer_form import YesNo, format_failures, yes_no
from infthor_eval.nieh.results.cells import Cell, make_cell, score_of, with_missing
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

CLUE_COLUMNS = ("1", "2", ">=3", "total")  # the columns of the paper's Table 4
OPEN_ENDED = "open-ended"  # column of questions whose answer is neither yes, no nor a number

SHOWN_CLUES = ("all", "some", "none")

Record = UnitRecord[NiehAnswer]


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
    """Scores of samples with contexts of about one length, and those above blind by scorer."""

    cell: Cell
    above_blind: dict[str, float | None]


class SkippedSummary(msgspec.Struct, frozen=True):
    """Samples that cannot be asked, by reason; and the mean by metric if they and all others
    without an answer counted as wrong."""

    n: int
    by_reason: dict[str, int]
    mean_counting_them_wrong: dict[str, float | None]


class Failure(msgspec.Struct, frozen=True):
    """A sample on which the model failed, or that it was not asked, and the reason."""

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
        above_blind: the share of what `blind` has not that the replies got, by scorer.
        format_failures: number of replies that are not of the form asked for, by reason.
        n_thought: number of replies behind thoughts.
        tokens_per_right: tokens of all replies, thoughts included, for each right answer under the
            main metric; None if none is right or the model counts no tokens.
        below_full_marks: answered samples with a score below 1, by metric.
        scores: scores of the answered samples by metric, trajectory and sample.
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
    above_blind: dict[str, AboveBlind]
    skipped: SkippedSummary
    yes_no: YesNo
    format_failures: dict[str, int]
    n_thought: int
    tokens_per_right: float | None
    below_full_marks: dict[str, list[str]]
    scores: dict[str, dict[str, dict[str, float]]]
    failures: list[Failure]
    memory: MemorySummary | None = None
    pairs: PairSummary | None = None

    @property
    def total(self) -> Cell:
        """Scores of all samples."""
        return self.by_clues["total"]


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
    """Return the main metric of each task with any answer: of twins net pairs, else the mean."""
    rates = {}
    for name, task in summary.tasks.items():
        if task.pairs is not None:
            rates[name] = task.pairs.net_pairs
            continue
        score = task.total.scores.get(main_metric(task))
        if score is not None:
            rate = Rate(score.mean, score.low, score.high, task.total.n_answered)
            rates[name] = rate.out_of(task.total.n)
    return rates


def _task(replies: Sequence[Record], task: NiehTaskConfig, config: NiehConfig) -> TaskSummary:
    metrics = list(task.metrics.names)
    records = [mean_record(same) for same in by_question(replies)]
    n_missing = max(0, task.n_samples - len(records))
    answered = [record for record in records if record.state == "answered"]
    files = _by_file(records)
    return TaskSummary(
        n=len(records) + n_missing,
        context=task.context,
        simulator=task.simulator,
        metrics=metrics,
        by_clues=_by_clues(records, metrics, n_missing),
        by_question_type=_group(records, metrics, _question_type),
        by_variant=_group(records, metrics, lambda record: record.variant or "-"),
        by_file={name: make_cell(chosen, metrics) for name, chosen in files.items()},
        evidence={
            name: _evidence(chosen, metrics) for name, chosen in {"total": records, **files}.items()
        },
        by_length=_by_length(records, metrics),
        above_blind=_above_blind(answered, metrics),
        skipped=_summarise_skipped(records, n_missing, metrics, task.skipped),
        yes_no=yes_no(replies),
        format_failures=format_failures(replies, task.decoding["max_new_tokens"]),
        n_thought=sum(record.payload.thinking is not None for record in replies),
        tokens_per_right=_tokens_per_right(replies, _main_metric(metrics)),
        below_full_marks={name: _below_full_marks(answered, name) for name in metrics},
        scores={name: _by_trajectory(answered, name) for name in metrics},
        failures=_failures(replies),
        memory=summarise_memory(config, task, records),
        pairs=summarise_pairs(replies, _main_metric(metrics), n_missing),
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
    return [str(record.key) for record in records if score_of(record, metric) < 1.0]


def _failures(replies: Sequence[Record]) -> list[Failure]:
    return [
        Failure(str(record.key), record.failure) for record in replies if record.failure is not None
    ]


def _tokens_per_right(replies: Sequence[Record], metric: str) -> float | None:
    counts = [record.tokens.reply for record in replies if record.tokens.reply is not None]
    right = _sum(replies, metric)
    return sum(counts) / right if counts and right else None


def _sum(records: Sequence[Record], metric: str) -> float:
    return math.fsum(score_of(record, metric) for record in records)


def _by_trajectory(records: Sequence[Record], metric: str) -> dict[str, dict[str, float]]:
    scores: dict[str, dict[str, float]] = {}
    for record in records:
        scores.setdefault(record.cluster, {})[str(record.key)] = score_of(record, metric)
    return scores


def _by_clues(records: Sequence[Record], metrics: Sequence[str], n_missing: int) -> dict[str, Cell]:
    columns: dict[str, list[Record]] = {name: [] for name in (*CLUE_COLUMNS, ABSENCE)}
    for record in records:
        if record.payload.clue_column in columns:
            columns[record.payload.clue_column].append(record)
    columns["total"] = list(records)
    columns[OPEN_ENDED] = [record for record in records if is_open_ended(record)]
    cells = {name: make_cell(chosen, metrics) for name, chosen in columns.items()}
    cells["total"] = with_missing(cells["total"], n_missing)
    return cells


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
    return {name: make_cell(chosen, metrics) for name, chosen in sorted(groups.items())}


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
            cells[name] = make_cell(chosen, metrics)
    return cells


def _by_length(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, LengthCell]:
    cells = {}
    for name, cell in _in_order(records, metrics, _length, LENGTHS).items():
        chosen = [
            record for record in records if _length(record) == name and record.state == "answered"
        ]
        shares = _above_blind(chosen, metrics)
        cells[name] = LengthCell(cell, {metric: share.mean for metric, share in shares.items()})
    return cells


def _above_blind(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, AboveBlind]:
    return {name: above_blind(records, name) for name in metrics if name in SCORERS}


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


def _summarise_skipped(
    records: Sequence[Record],
    n_missing: int,
    metrics: Sequence[str],
    skipped: Sequence[SkippedSample],
) -> SkippedSummary:
    n = len(records) + n_missing + len(skipped)
    means = {name: _sum(records, name) / n if n else None for name in metrics}
    reasons = Counter(sample.reason for sample in skipped)
    return SkippedSummary(len(skipped), dict(sorted(reasons.items())), means)
