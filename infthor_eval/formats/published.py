"""Numbers that the authors published, as data: `results/published/*.yaml`, a file for each table.

A row is compared with a run if the run's checkpoint has one of the row's names and about as many
parameters. The name alone is not enough: one adapter runs a 3B and a 7B checkpoint, and a local
folder can have any name.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.storage.folders import packaged_folder

PUBLISHED_DATA = (
    "Published rows are on the published data; a run on other data, such as your own, is not "
    "comparable with them."
)
# Relative tolerance: counts of one model differ with its heads and tied embeddings.
_SAME_SIZE = 0.1


class PublishedRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The row of a model by its name in the paper.

    Attributes:
        checkpoints: hub ids of the evaluated checkpoints.
        parameters: number of parameters of the checkpoint, in billions; None if it is not known.
        values: one number per column, in percent.
        source: origin of the row, if it is not that of the table.
        task: task of ours, or group of tasks, that asks as the row was made; None if there is none.
        match: column of the published question files with the scores behind the row, if they have
            it.
        log: model in the name of the published plan log behind the row, if there is one.
        misprints: by column, the number that the row should have; only where the printed one is
            known to be wrong.
    """

    name: str
    checkpoints: tuple[str, ...]
    parameters: float | None
    values: tuple[float, ...]
    source: str | None = None
    task: str | None = None
    match: str | None = None
    log: str | None = None
    misprints: Mapping[str, float] = {}

    def matches(self, model: Mapping[str, Any]) -> bool:
        """Return True if this row is about the model that a run's config describes."""
        checkpoint = str(model.get("checkpoint", "")).rstrip("/").rpartition("/")[2].lower()
        if checkpoint not in {name.rpartition("/")[2].lower() for name in self.checkpoints}:
            return False
        count = model.get("n_parameters")
        if count is None or self.parameters is None:
            return True
        return abs(count / 1e9 - self.parameters) <= _SAME_SIZE * self.parameters


class PublishedTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the paper, or one of numbers that are published elsewhere.

    Attributes:
        title: short name ("Table 4").
        source: paper and table, or the file, that the numbers are from.
        suite: suite whose results can be compared with the table.
        context: evaluated setting (for NIEH: the context).
        columns: names of the columns, as in the suite's summary if it has them.
        rows: rows in the paper's order.
        notes: what is to be known about the numbers, such as other published ones; shown below
            them.
    """

    title: str
    source: str
    suite: str
    context: str
    metric: str
    columns: tuple[str, ...]
    rows: tuple[PublishedRow, ...]
    notes: tuple[str, ...] = ()


@cache
def published_tables(suite: str) -> tuple[PublishedTable, ...]:
    """Return the published tables of a suite, in the order of their file names."""
    folder = packaged_folder("results") / "published"
    tables = [_read(path) for path in sorted(folder.glob("*.yaml"))]
    return tuple(table for table in tables if table.suite == suite)


def _read(path: Path) -> PublishedTable:
    hint = "install infthor-eval again"
    with wrap_errors(
        f"{path}: not a table of published numbers", hint, catch=msgspec.ValidationError
    ):
        table = msgspec.convert(read_yaml(path, hint), PublishedTable)
    for row in table.rows:
        if len(row.values) != len(table.columns):
            raise DataError(
                f"{path}: {row.name} has {len(row.values)} values for {len(table.columns)} columns"
            )
    return table
