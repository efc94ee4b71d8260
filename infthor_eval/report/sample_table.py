"""Samples of runs as a table with a row for each, for programs that analyse data."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from infthor_eval.formats.csv_files import shield
from infthor_eval.report.sample import Sample
from infthor_eval.report.sample_columns import ENVELOPE, SampleColumn
from infthor_eval.run import Run, open_runs
from infthor_eval.runs import UnitRecord
from infthor_eval.terminal import printable

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Table

FORMS = ("csv", "parquet")


def sample_table(runs: Sequence[Run]) -> Table:
    """Return a table with a row per sample, in the order of the runs and of their units' keys.

    The columns are run, suite, `ENVELOPE`, a `score_...` for each metric, and those of the
    presenters. Cells of columns that another suite's runs have are empty.

    Args:
        runs: at least one run.
    """
    import pyarrow

    return pyarrow.concat_tables([_table_of(run) for run in runs], promote_options="default")


def _table_of(run: Run) -> Table:
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
    arrays = {}
    for column in columns:
        cells = [column.value(record) for record in run.records]
        arrays[column.name] = pyarrow.array(cells, types[column.cell_type])
    return pyarrow.table(arrays)


def _score_columns(run: Run) -> list[SampleColumn]:
    metrics = dict.fromkeys(metric for record in run.records for metric in run.suite.scores(record))
    return [
        SampleColumn(f"score_{metric}", float, partial(_score, run, metric)) for metric in metrics
    ]


def _score(run: Run, metric: str, record: UnitRecord[Any]) -> float | None:
    """Return a score as summaries count it; None for a sample without a result."""
    sample = Sample(run, record)
    return sample.scores.get(metric, 0.0) if sample.is_answered else None


def load_run(folder: str | os.PathLike[str]) -> DataFrame:
    """See `infthor_eval.load_run`."""
    return sample_table(open_runs([Path(folder)], warnings.warn)).to_pandas()


def encode_samples(table: Table, file_format: str) -> bytes:
    """Return the bytes of a file: "csv" or "parquet".

    CSV is opened in spreadsheets and printed on terminals: a text that would be a formula begins
    with an apostrophe, and control characters are escaped. Parquet has all texts as they are.
    """
    import pyarrow.csv
    import pyarrow.parquet

    file = io.BytesIO()
    if file_format == "parquet":
        pyarrow.parquet.write_table(table, file)
    else:
        pyarrow.csv.write_csv(_with_safe_texts(table), file)
    return file.getvalue()


def _with_safe_texts(table: Table) -> Table:
    import pyarrow

    for index, column in enumerate(table.columns):
        if pyarrow.types.is_string(column.type):
            texts = [
                None if text is None else shield(printable(text)) for text in column.to_pylist()
            ]
            table = table.set_column(
                index, table.column_names[index], pyarrow.array(texts, pyarrow.string())
            )
    return table
