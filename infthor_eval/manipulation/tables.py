"""Results of arms as tables: Table 6 beside the published rows, and what there is to say of the episodes."""

from collections.abc import Iterator, Sequence
from itertools import zip_longest

from infthor_eval.formats.published import published_tables
from infthor_eval.manipulation.history import ManipulationKind
from infthor_eval.manipulation.summary import ManipulationSummary, TaskSummary
from infthor_eval.rates import Rate, format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, left_out_notes

__all__ = ["overview", "tables"]

_N_FIRST = 6  # columns of the table of success that stand in the overview: those before what was left out
_EMBEDDED = "Made in the embedded simulator: not comparable with the published rows, which are of AI2-THOR's own."


def overview(runs: Sequence[RunSummary]) -> list[Table]:
    """Success by kind."""
    whole = _success_table(runs)
    columns = whole.columns[:_N_FIRST]
    rows = tuple(Row(row.cells[:_N_FIRST]) for row in whole.rows if not row.is_published)
    return [Table("Low-level manipulation, success %, 95 % interval in brackets", columns, rows, whole.notes)]


def tables(runs: Sequence[RunSummary]) -> list[Table]:
    """The tables of some runs."""
    return [_success_table(runs), _episodes_table(runs), _endings_table(runs)]


def _named(runs: Sequence[RunSummary]) -> Iterator[tuple[str, ManipulationSummary]]:
    for run in runs:
        assert isinstance(run.summary, ManipulationSummary)
        frames = run.header.config["frames"]
        yield run.header.name if frames == "shown" else f"{run.header.name}, {frames} frames", run.summary


def _success_table(runs: Sequence[RunSummary]) -> Table:
    """Success by kind; a row for each radius of a run's tasks."""
    rows = []
    for name, summary in _named(runs):
        by_kind = {kind: [task for task in summary.tasks.values() if task.kind == kind] for kind in ManipulationKind}
        for pair in zip_longest(*by_kind.values()):
            rows.append(Row((name, _radii(pair), *_cells(pair))))
    for table in published_tables("manipulation"):
        for row in table.rows:
            values = (f"{value:.2f}" for value in row.values)
            rows.append(Row((row.name, f"published, {table.title}", *values), is_published=True))
    names = ("Pick-up", "Put", "pick-ups", "puts", "trajectories", "excluded", "skipped", "failed")
    columns = (Column("model", False), Column("radius, m", False), *map(Column, names))
    return Table("Low-level manipulation, success %", columns, tuple(rows), tuple(_notes(runs)))


def _radii(pair: Sequence[TaskSummary | None]) -> str:
    return ", ".join(dict.fromkeys(f"{task.radius:g}" for task in pair if task is not None))


def _cells(pair: Sequence[TaskSummary | None]) -> Iterator[str]:
    there = [task for task in pair if task is not None]
    yield from (format_percent(task.success if task else None) for task in pair)
    yield from (str(_size(task.success) if task else 0) for task in pair)
    yield str(max(task.n_trajectories for task in there))
    yield str(sum(sum(task.excluded.values()) for task in there))
    yield str(max(sum(task.skipped.values()) for task in there))
    yield str(sum(task.n_failed for task in there))


def _size(rate: Rate | None) -> int:
    return 0 if rate is None else rate.n


def _episodes_table(runs: Sequence[RunSummary]) -> Table:
    rows = [
        Row((
            name, task_name, f"{task.radius:g}",
            format_percent(task.inside if task.kind == ManipulationKind.PICKUP else None),
            _number(task.closest, 2), _number(task.steps), _number(task.collisions),
        ))
        for name, summary in _named(runs)
        for task_name, task in summary.tasks.items()
    ]  # fmt: skip
    names = ("in the sphere at the start, %", "closest, m", "steps", "collisions")
    columns = (Column("model", False), Column("task", False), Column("radius, m"), *map(Column, names))
    return Table("Episodes", columns, tuple(rows))


def _endings_table(runs: Sequence[RunSummary]) -> Table:
    found = [(name, task_name, task) for name, summary in _named(runs) for task_name, task in summary.tasks.items()]
    endings = list(dict.fromkeys(ending for _, _, task in found for ending in task.endings))
    rows = [Row((*names, *(str(task.endings.get(ending, 0)) for ending in endings))) for *names, task in found]
    columns = (Column("model", False), Column("task", False), *map(Column, endings))
    return Table("How episodes ended", columns, tuple(rows))


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _notes(runs: Sequence[RunSummary]) -> list[str]:
    notes = [_EMBEDDED] if any(summary.simulator == "embedded" for _, summary in _named(runs)) else []
    return notes + left_out_notes([[(t.excluded, t.skipped) for t in s.tasks.values()] for _, s in _named(runs)])
