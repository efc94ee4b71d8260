"""Numbers that the paper reports, as data: `results/published/*.yaml`. A new table is a new file.

A row belongs to a run if the run's checkpoint has one of the row's names and about as many parameters: an adapter can
run a 3B and a 7B checkpoint, and a folder can have any name.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.formats.yaml_files import read_yaml

__all__ = ["PublishedRow", "PublishedTable", "published_tables"]

_SAME_SIZE = 0.1  # relative difference; checkpoints of one architecture differ by heads and tied embeddings


class PublishedRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One model's row.

    Attributes:
        name: the paper's name of the model.
        checkpoints: hub ids that the numbers are of.
        parameters: how many the checkpoint has, in billions.
        values: a number per column, percent.
    """

    name: str
    checkpoints: tuple[str, ...]
    parameters: float
    values: tuple[float, ...]

    def matches(self, model: Mapping[str, Any]) -> bool:
        """Whether a run's model, by its identity, is the one that this row is about."""
        checkpoint = str(model.get("checkpoint", "")).rstrip("/").rpartition("/")[2].lower()
        if checkpoint not in {name.rpartition("/")[2].lower() for name in self.checkpoints}:
            return False
        count = model.get("n_parameters")
        return count is None or abs(count / 1e9 - self.parameters) <= _SAME_SIZE * self.parameters


class PublishedTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the paper.

    Attributes:
        title: what people call it ("Table 4").
        source: where it stands.
        suite: the suite whose results it can be compared with.
        context: the way of evaluating that it is about (of NIEH: the context).
        metric: how its numbers were scored.
        columns: names of the columns, as the suite's summary names them.
        rows: in the paper's order.
    """

    title: str
    source: str
    suite: str
    context: str
    metric: str
    columns: tuple[str, ...]
    rows: tuple[PublishedRow, ...]


@cache
def published_tables(suite: str) -> tuple[PublishedTable, ...]:
    """The published tables of a suite, in the order of their files' names.

    Raises:
        DataError: a file is not what it should be.
    """
    folder = packaged_folder("results") / "published"
    tables = [_read(path) for path in sorted(folder.glob("*.yaml"))]
    return tuple(table for table in tables if table.suite == suite)


def _read(path: Path) -> PublishedTable:
    with wrap_errors(
        f"{path}: not a table of published numbers", "install infthor-eval again", catch=msgspec.ValidationError
    ):
        table = msgspec.convert(read_yaml(path, "install infthor-eval again"), PublishedTable)
    for row in table.rows:
        if len(row.values) != len(table.columns):
            raise DataError(f"{path}: {row.name} has {len(row.values)} values for {len(table.columns)} columns")
    return table
