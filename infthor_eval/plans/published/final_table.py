"""The published table of final tasks from the published plan logs: plans done of plans counted."""

from collections.abc import Iterator, Mapping, Sequence

from infthor_eval.formats.plan_logs import PlanCount, PlanLog
from infthor_eval.formats.published import PublishedRow, PublishedTable, published_tables
from infthor_eval.plans.summary import FINAL_COLUMNS
from infthor_eval.rates import clustered_rate
from infthor_eval.tables import Column, Row, Table, TableCell, interval_cell

_TITLE = "final long-horizon tasks"
_NOTES = (
    "95 %: interval of the total, clustered by trajectory. Trajectories whose set-up failed have "
    "no plan in the log.",
)


def final_table(logs: Sequence[PlanLog]) -> Table:
    """Return the table as logs (at least one) give it, each row above the printed one.

    A log whose name is not that of a printed row stands alone; printed rows that no log is of are
    listed below.
    """
    published = next(table for table in published_tables("plans") if table.title == _TITLE)
    by_log = {row.log: row for row in published.rows if row.log is not None}
    rows = []
    remarks = []
    n_cells = 0
    for log in logs:
        printed = by_log.get(log.model or "")
        counts = count_plans(log)
        rows.append(_row_of(log, counts, ends_section=printed is None))
        if printed is not None:
            cells, wrong = _printed(printed, published, counts)
            rows.append(
                Row((printed.name, "printed", *cells), is_published=True, ends_section=True)
            )
            remarks += wrong
            n_cells += len(cells)
    rows += _without_log(published, logs)
    follow = f"{n_cells - len(remarks)} of {n_cells} printed cells follow from these logs."
    numbers = map(Column, (*FINAL_COLUMNS, "95 %", "set-up failed"))
    columns = (Column("model", False), Column("from", False), *numbers)
    return Table(
        "Final long-horizon tasks: plans done, % (plans)",
        columns,
        tuple(rows),
        (*([follow] if n_cells else []), *remarks, *_NOTES, *published.notes, *_same_logs(logs)),
    )


def count_plans(log: PlanLog) -> dict[str, PlanCount]:
    """Return the plans of a log by column of the published table."""
    rows = log.rows
    counts = (
        _total([row.goto for row in rows]),
        _total([row.pick for row in rows]),
        _total([row.put for row in rows]),
        _total([row.total for row in rows]),
    )
    return dict(zip(FINAL_COLUMNS, counts, strict=True))


def _total(counts: Sequence[PlanCount]) -> PlanCount:
    return PlanCount(sum(count.n_done for count in counts), sum(count.n for count in counts))


def _row_of(log: PlanLog, counts: Mapping[str, PlanCount], ends_section: bool) -> Row:
    n_failed = sum(not row.total.n for row in log.rows)
    cells = *map(_cell, counts.values()), _interval(log), f"{n_failed} of {len(log.rows)}"
    return Row((log.model or log.path.name, "the log", *cells), ends_section=ends_section)


def _interval(log: PlanLog) -> TableCell:
    """Return the interval of the share of all plans that are done."""
    plans = [
        (float(number < row.total.n_done), row.traj_id)
        for row in log.rows
        for number in range(row.total.n)
    ]
    rate = clustered_rate([done for done, _ in plans], [traj_id for _, traj_id in plans])
    low = None if rate is None or rate.low is None else 100 * rate.low
    high = None if rate is None or rate.high is None else 100 * rate.high
    return interval_cell(low, high, pattern="{}–{}")


def _cell(count: PlanCount) -> TableCell:
    share = _percent(count)
    return TableCell(
        f"{share} ({count.n_done} of {count.n})",
        {"": share, "done": str(count.n_done), "of": str(count.n)},
    )


def _percent(count: PlanCount) -> str:
    return f"{100 * count.n_done / count.n:.1f}" if count.n else "-"


def _printed(
    row: PublishedRow, table: PublishedTable, counts: Mapping[str, PlanCount]
) -> tuple[list[str], list[str]]:
    """Return the printed cells, with a mark where they do not follow, and a note on each mark."""
    cells = []
    notes = []
    for name, value in zip(table.columns, row.values, strict=True):
        follows = _percent(counts[name]) == f"{value:.1f}"
        cells.append(f"{value:.1f}{'' if follows else '*'}")
        if not follows:
            why = _explanation(f"{value:.1f}", name, counts)
            logged = f"in the log {_cell(counts[name])}"
            notes.append(f"*: {row.name}, {name}: printed {value:.1f}, {logged}. {why}")
    return cells, notes


def _explanation(printed: str, column: str, counts: Mapping[str, PlanCount]) -> str:
    """Return how the log's counts give the printed share if the column's own do not."""
    for done in (column, *counts):
        for of, count in counts.items():
            share = PlanCount(counts[done].n_done, count.n)
            if _percent(share) == printed:
                return (
                    f"{printed} is {share.n_done} of {share.n}: {done} done, of the plans of {of}."
                )
    return f"No counts of this log give {printed}."


def _without_log(table: PublishedTable, logs: Sequence[PlanLog]) -> Iterator[Row]:
    """Yield the printed rows that none of the logs is of."""
    logged = {log.model for log in logs}
    for row in table.rows:
        if row.log is None or row.log not in logged:
            yield Row((row.name, "printed", *map("{:.1f}".format, row.values)), is_published=True)


def _same_logs(logs: Sequence[PlanLog]) -> Iterator[str]:
    """Yield a note on each log that is an earlier one under another name."""
    first: dict[str, PlanLog] = {}
    for log in logs:
        if log.digest in first:
            yield f"{log.path.name} is byte for byte {first[log.digest].path.name}."
        first.setdefault(log.digest, log)
