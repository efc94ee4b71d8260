"""Rows of the leaderboard: of submissions that passed, and of published tables."""

from collections.abc import Iterator, Sequence
from statistics import fmean

from msgspec.structs import replace

from infthor_board.checking import Verdict
from infthor_board.expected import Expected
from infthor_board.page import LeaderboardRow
from infthor_board.statement import Statement
from infthor_eval.exports.subjects import engine_of
from infthor_eval.formats.published import published_tables
from infthor_eval.nieh.results.above_blind import above_blind
from infthor_eval.nieh.results.pair_summary import summarise_pairs
from infthor_eval.rates import Rate, clustered_rate

_SCORER = "strict"
_CONTEXTS = {"clues": "the clue frames", "trajectory": "whole trajectories"}


def rows_of(verdict: Verdict) -> Iterator[LeaderboardRow]:
    """Yield a row for each task of a submission that passed; scores are made from its replies."""
    statement = verdict.case.submission.statement
    assert statement is not None and not verdict.refusals
    for task in verdict.case.shown:
        prefix = f"{task.name}: "
        remarks = [
            problem.text.removeprefix(prefix)
            for problem in verdict.warnings
            if problem.text.startswith(prefix)
        ]
        yield _row(statement, task, remarks)


def _row(statement: Statement, task: Expected, remarks: Sequence[str]) -> LeaderboardRow:
    records = task.graded
    clusters = [record.cluster for record in records]
    replied = [record for record in records if record.state == "answered"]
    singles = [record.payload.scores.get(_SCORER, 0.0) for record in records]
    usage = [record.usage.cost for record in replied if record.usage.cost is not None]
    seconds = [record.seconds for record in replied if record.seconds]
    return LeaderboardRow(
        model=statement.model,
        revision=statement.revision,
        task=task.name,
        shown=_shown(task),
        frames=f"{task.data.simulator} simulator" if task.data.simulator else "",
        pairs=_pairs(task),
        singles=clustered_rate(singles, clusters),
        above=_above(task),
        n=len(records),
        failed=len(records) - len(replied),
        tokens_read=_mean([it.tokens.context for it in replied]),
        tokens_written=_mean([it.tokens.reply for it in replied]),
        cost=sum(usage) if usage else None,
        seconds=fmean(seconds) if seconds else None,
        engine=_engine(statement, task),
        date=statement.date.isoformat(),
        by=statement.submitted_by,
        url=statement.url,
        remarks=remarks,
    )


def _pairs(task: Expected) -> Rate | None:
    """Return the net pairs; one without both replies is neither right nor exchanged."""
    replied = [replace(record, failure=None) for record in task.graded]
    summary = summarise_pairs(replied, _SCORER)
    return None if summary is None else summary.net_pairs


def _above(task: Expected) -> Rate | None:
    above = above_blind(task.graded, _SCORER)
    return None if above.mean is None else Rate(above.mean, above.low, above.high, above.n)


def _shown(task: Expected) -> str:
    config = task.run.header.config
    context = task.stated.context
    memory = task.stated.memory
    parts = [_CONTEXTS.get(context, context.replace("_", " "))]
    if memory is not None:
        parts.append(memory.name)
    if config.budget:
        parts.append(f"budget {config.in_words('budget', config.budget)}")
    return ", ".join(parts)


def _engine(statement: Statement, task: Expected) -> str:
    name, version = engine_of(task.run.header.config.model)
    return f"{name} {version}" if name and not task.run.is_export else statement.engine


def _mean(counts: Sequence[int | None]) -> float | None:
    known = [count for count in counts if count is not None]
    return fmean(known) if known else None


def published_rows() -> list[LeaderboardRow]:
    """Return the published numbers on NIEH, a row for each model and column."""
    return [
        LeaderboardRow(
            model=row.name,
            task=f"{table.title}: {_column(column)}",
            shown=_CONTEXTS.get(table.context, table.context.replace("_", " ")),
            frames="AI2-THOR",
            singles=Rate(value / 100, None, None, 0),
            scorer="published",
            by=row.source or table.source,
            is_published=True,
        )
        for table in published_tables("nieh")
        for row in table.rows
        for column, value in zip(table.columns, row.values, strict=True)
        if column == "total" or "total" not in table.columns
    ]


def _column(name: str) -> str:
    return name.removeprefix("nieh_").removeprefix("nsieh_").replace("_", " ")
