"""Samples of runs as a table with a row for each, for programs that analyse data."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from infthor_eval.formats.csv_files import shield
from infthor_eval.report.runs import ReportRun
from infthor_eval.runs import UnitRecord
from infthor_eval.terminal import printable

if TYPE_CHECKING:
    from pyarrow import Table

__all__ = ["ENVELOPE", "FORMS", "SampleColumn", "encode_samples", "payload_column", "sample_table"]

FORMS = ("csv", "parquet")


class SampleColumn(NamedTuple):
    """A column.

    Attributes:
        name: its name; docs/formats.md says what it holds, in which unit.
        form: type of its cells: str, int, float or bool.
        value: returns the cell of a record; None for an empty one.
    """

    name: str
    form: type
    value: Callable[[UnitRecord[Any]], str | float | bool | None]


def payload_column(name: str, form: type) -> SampleColumn:
    """Return the column of a field of the payload."""
    return SampleColumn(name, form, attrgetter(f"payload.{name}"))


ENVELOPE = (
    SampleColumn("task", str, lambda record: record.task),
    SampleColumn("id", str, lambda record: record.id),
    SampleColumn("variant", str, lambda record: record.variant),
    SampleColumn("repeat", int, lambda record: record.repeat),
    SampleColumn("cluster", str, lambda record: record.cluster),
    SampleColumn("attempt", int, lambda record: record.attempt),
    SampleColumn("failure", str, lambda record: record.failure),
    SampleColumn("excluded", str, lambda record: record.excluded),
    SampleColumn("n_faults", int, lambda record: len(record.faults)),
    SampleColumn("seconds", float, lambda record: record.seconds),
    SampleColumn("context_tokens", int, lambda record: record.tokens.context),
    SampleColumn("cached_tokens", int, lambda record: record.tokens.cached),
    SampleColumn("reply_tokens", int, lambda record: record.tokens.reply),
    SampleColumn("requests", int, lambda record: record.usage.requests),
    SampleColumn("cost", float, lambda record: record.usage.cost),
)


def sample_table(runs: Sequence[ReportRun]) -> Table:
    """Return a table with a row per sample, in the order of the runs and of their units' keys.

    The columns are run, suite, `ENVELOPE`, a `score_...` for each metric, and those of the
    presenters. Cells of columns that another suite's runs have are empty.

    Args:
        runs: at least one run.
    """
    import pyarrow

    return pyarrow.concat_tables([_table_of(run) for run in runs], promote_options="default")


def _table_of(run: ReportRun) -> Table:
    import pyarrow

    types = {
        str: pyarrow.string(),
        int: pyarrow.int64(),
        float: pyarrow.float64(),
        bool: pyarrow.bool_(),
    }
    name = run.label
    suite = run.suite.name
    run_columns = (
        SampleColumn("run", str, lambda _: name),
        SampleColumn("suite", str, lambda _: suite),
    )
    columns = (*run_columns, *ENVELOPE, *_score_columns(run), *run.presenter.columns)
    return pyarrow.table(
        {
            column.name: pyarrow.array(
                [column.value(record) for record in run.records], types[column.form]
            )
            for column in columns
        }
    )


def _score_columns(run: ReportRun) -> list[SampleColumn]:
    metrics = dict.fromkeys(metric for record in run.records for metric in run.suite.scores(record))
    return [
        SampleColumn(f"score_{metric}", float, partial(_score, run, metric)) for metric in metrics
    ]


def _score(run: ReportRun, metric: str, record: UnitRecord[Any]) -> float | None:
    """Return a score as the run's summary counts it: 0 for a failed unit, none for one that does
    not count."""
    return None if record.excluded is not None else run.suite.scores(record).get(metric, 0.0)


def encode_samples(table: Table, form: str) -> bytes:
    """Return the bytes of a file: "csv" or "parquet".

    CSV is opened in spreadsheets and printed on terminals: a text that would be a formula begins
    with an apostrophe, and control characters are escaped. Parquet has all texts as they are.
    """
    import pyarrow.csv
    import pyarrow.parquet

    file = io.BytesIO()
    if form == "parquet":
        pyarrow.parquet.write_table(table, file)
    else:
        pyarrow.csv.write_csv(_with_safe_texts(table), file)
    return file.getvalue()


def _with_safe_texts(table: Table) -> Table:
    import pyarrow

    for place, column in enumerate(table.columns):
        if pyarrow.types.is_string(column.type):
            texts = [
                None if text is None else shield(printable(text)) for text in column.to_pylist()
            ]
            table = table.set_column(
                place, table.column_names[place], pyarrow.array(texts, pyarrow.string())
            )
    return table
