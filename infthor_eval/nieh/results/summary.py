"""The summary of a run of NIEH: a pure function of its journal.

Summaries are over questions, so a question that was asked N times counts once, with its mean
scores. What a set of other trajectories would change and what another drawing would change are two
things: the intervals of all tables are over trajectories, `drawing` is of the drawing alone.

Cache hits are not in it: they differ between a run and the same run resumed. What a memory took is
a field of its own, `took`, which results.json leaves out.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import groupby
from statistics import fmean, variance
from typing import Any

import msgspec

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig, SkippedSample
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.results.above_blind import AboveBlind, above_blind
from infthor_eval.nieh.results.answer_form import YesNo, format_failures, yes_no
from infthor_eval.nieh.results.cells import Cell, make_cell, score_of, with_missing
from infthor_eval.nieh.results.facets import FACETS, FILE, LENGTH
from infthor_eval.nieh.results.memory_summary import (
    MemorySummary,
    MemoryTimes,
    summarise_memory,
    time_memory,
)
from infthor_eval.nieh.results.pair_summary import PairSummary, summarise_pairs
from infthor_eval.nieh.scoring import SCORERS, compared_form
from infthor_eval.rates import Rate
from infthor_eval.runs import RunSummary, UnitRecord

CLUE_COLUMNS = ("1", "2", ">=3", "total")  # the columns of the paper's Table 4
OPEN_ENDED = "open-ended"  # column of questions whose answer is neither yes, no nor a number
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
        by: cells by facet and class (`FACETS`): `by_FACET` in results.json.
        files: the same of the samples of each question file, by the facets that have it.
        above_blind_by_length: scores above blind by length of the context and scorer.
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
    by: dict[str, dict[str, Cell]]
    files: dict[str, dict[str, dict[str, Cell]]]
    above_blind_by_length: dict[str, dict[str, float | None]]
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

    def document(self) -> dict[str, Any]:
        """Return the task as results.json has it."""
        document: dict[str, Any] = msgspec.to_builtins(self)
        by, files = document.pop("by"), document.pop("files")
        total = {facet.name: by.pop(facet.name) for facet in FACETS if facet.of_files}
        above = document.pop("above_blind_by_length")
        by[LENGTH.name] = {
            name: {"cell": cell, "above_blind": above[name]}
            for name, cell in by[LENGTH.name].items()
        }
        evidence = {name: _fields(of_file) for name, of_file in {"total": total, **files}.items()}
        pairs = document["pairs"]
        if pairs is not None:
            pairs |= _fields(pairs.pop("by"))
        return document | _fields(by) | {"evidence": evidence}


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

    def document(self) -> dict[str, Any]:
        """Return the summary as results.json has it."""
        document: dict[str, Any] = msgspec.to_builtins(self)
        return document | {"tasks": {name: task.document() for name, task in self.tasks.items()}}


def _fields(by: dict[str, Any]) -> dict[str, Any]:
    return {f"by_{name}": cells for name, cells in by.items()}


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


def named_tasks(runs: Iterable[RunSummary]) -> Iterator[tuple[str, str, TaskSummary]]:
    """Yield the run's name, the task's name and the task, of all runs."""
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        for name, task in run.summary.tasks.items():
            yield run.header.label, name, task


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
    records = [_mean_record(same) for same in by_question(replies)]
    n_missing = max(0, task.n_samples - len(records))
    answered = _answered(records)
    cells = partial(make_cell, metrics=metrics)
    return TaskSummary(
        n=len(records) + n_missing,
        context=task.context,
        simulator=task.simulator,
        metrics=metrics,
        by_clues=_by_clues(records, metrics, n_missing),
        by={facet.name: facet.means(records, cells) for facet in FACETS},
        files={
            name: {facet.name: facet.means(same, cells) for facet in FACETS if facet.of_files}
            for name, same in FILE.split(records).items()
        },
        above_blind_by_length={
            length: {
                name: share.mean for name, share in _above_blind(_answered(same), metrics).items()
            }
            for length, same in LENGTH.split(records).items()
        },
        above_blind=_above_blind(answered, metrics),
        skipped=_summarise_skipped(records, n_missing, metrics, task.skipped),
        yes_no=yes_no(replies),
        format_failures=format_failures(replies, task.decoding["max_new_tokens"]),
        n_thought=sum(record.payload.thinking is not None for record in replies),
        tokens_per_right=_tokens_per_right(replies, _main_metric(metrics)),
        below_full_marks={name: _below_full_marks(answered, name) for name in metrics},
        scores={name: _by_trajectory(answered, name) for name in metrics},
        failures=[Failure(str(it.key), it.failure) for it in replies if it.failure is not None],
        memory=summarise_memory(config, task, records),
        pairs=summarise_pairs(replies, _main_metric(metrics), n_missing),
    )


def _answered(records: Sequence[Record]) -> list[Record]:
    return [record for record in records if record.state == "answered"]


def _below_full_marks(records: Sequence[Record], metric: str) -> list[str]:
    return [str(record.key) for record in records if score_of(record, metric) < 1.0]


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


def _above_blind(records: Sequence[Record], metrics: Sequence[str]) -> dict[str, AboveBlind]:
    return {name: above_blind(records, name) for name in metrics if name in SCORERS}


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


def by_question(records: Sequence[Record]) -> list[list[Record]]:
    """Return the records of each question in its variant, given records in key order."""
    return [list(same) for _, same in groupby(records, key=lambda record: record.key.once)]


def _mean_record(records: Sequence[Record]) -> Record:
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


def _scores(records: Sequence[Record], metric: str) -> list[float]:
    return [score_of(record, metric) for record in records]


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
