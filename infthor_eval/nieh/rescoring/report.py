"""What scoring again has changed, and how judge and rules agree: `rescored.json`, and tables."""

from collections.abc import Mapping, Sequence

import msgspec

from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.judging import JUDGED, Agreement, Verdicts
from infthor_eval.nieh.results.cells import percent
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.tables import Column, Row, Table

Record = UnitRecord[NiehAnswer]

_N_EXAMPLES = 3  # of replies whose score has changed, for each metric


class ChangedScore(msgspec.Struct, frozen=True):
    """A reply whose score today is not the one in the journal."""

    question: str
    reply: str
    before: float
    now: float


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """A metric of a task today, against the journal.

    Attributes:
        n: number of replies with a score today.
        mean: their mean today; None without any.
        n_before: number of these that have a score of this metric in the journal.
        mean_before: mean of those scores; None without any.
        n_differ: number of replies of which the two scores differ.
        examples: the first of them.
    """

    n: int
    mean: float | None
    n_before: int
    mean_before: float | None
    n_differ: int
    examples: list[ChangedScore]


class RescoringReport(msgspec.Struct, frozen=True, kw_only=True):
    """What scoring the replies of a run again has changed.

    Attributes:
        n_scored: replies with scores.
        n_without_reply: records without a reply, which stay failed.
        n_failed: replies on which the own scorer failed.
        n_missing: units without a record.
        left_out: metrics of the journal that are none of today's, by task.
        tasks: changes by task and metric.
        judge: what the judge says; None for no judge.
    """

    n_scored: int
    n_without_reply: int
    n_failed: int
    n_missing: int
    left_out: dict[str, list[str]]
    tasks: dict[str, dict[str, Change]]
    judge: Agreement | None


def find_changes(
    before: Mapping[UnitKey, Mapping[str, float]], records: Sequence[Record], names: Sequence[str]
) -> dict[str, Change]:
    """Compare a task's scores with those before, by unit: a change for each metric."""
    return {name: _change(before, records, name) for name in names}


def _change(
    before: Mapping[UnitKey, Mapping[str, float]], records: Sequence[Record], name: str
) -> Change:
    scored = [record for record in records if name in record.payload.scores]
    old_scores = []
    differing = []
    for record in scored:
        if name not in before[record.key]:
            continue
        old = before[record.key][name]
        new = record.payload.scores[name]
        old_scores.append(old)
        if old != new:
            differing.append(ChangedScore(record.id, record.payload.reply or "", old, new))
    return Change(
        n=len(scored),
        mean=_mean([record.payload.scores[name] for record in scored]),
        n_before=len(old_scores),
        mean_before=_mean(old_scores),
        n_differ=len(differing),
        examples=differing[:_N_EXAMPLES],
    )


def _mean(scores: Sequence[float]) -> float | None:
    return sum(scores) / len(scores) if scores else None


def sources_of(config: NiehConfig) -> dict[str, str]:
    """Return for each metric of a rescored run's config by whom it is, in words; else {}."""
    if config.rescored is None:
        return {}
    by: dict[str, str] = dict(
        zip(SCORERS, ("the published scorer", "our strict scorer"), strict=True)
    )
    scorer = config.rescored.scorer
    judge = config.rescored.judge
    if scorer:
        by |= {
            name: f"{scorer['name']} in {scorer.get('file') or scorer['package']}"
            for name in scorer["metrics"]
        }
    if judge:
        by[JUDGED] = f"strict, and {judge['label']} where the rules are unsure"
    return by


def change_table(report: RescoringReport, sources: Mapping[str, str]) -> Table:
    """Return the means today and in the journal, by task and metric, with whose metric it is."""
    rows = []
    for task, changes in report.tasks.items():
        for name, change in changes.items():
            differ = str(change.n_differ) if change.n_before else "-"
            means = (percent(change.mean_before, 2), percent(change.mean, 2))
            rows.append(Row((task, name, sources[name], str(change.n), *means, differ)))
    numbers = ("replies", "in the journal", "today", "scores that differ")
    columns = (
        Column("task", False),
        Column("metric", False),
        Column("by", False),
        *map(Column, numbers),
    )
    return Table("Scores of the replies, mean in %", columns, tuple(rows))


def agreement_table(agreement: Agreement, judge: str) -> Table:
    """Return what a judge says where the rules are unsure, and where they are sure."""
    rows = (
        _verdicts_row("the rules are unsure of", agreement.unsure),
        _verdicts_row("are right by the rules (sample)", agreement.right),
        _verdicts_row("are wrong by the rules (sample)", agreement.wrong),
    )
    numbers = ("n", "right", "partly", "wrong", "neither", "not asked")
    columns = (Column("open-ended replies that", False), *map(Column, numbers))
    note = f"Judge and rules agree on {percent(agreement.share, 2)} % of the sample."
    return Table(f"Verdicts of {judge}", columns, rows, (note,))


def _verdicts_row(name: str, counts: Verdicts) -> Row:
    return Row((name, *map(str, msgspec.structs.astuple(counts))))
