"""Columns of the table of samples: those of all suites, and what a suite's own are made of.

To add a column of samples (`show --per-sample`, `load_run`): here; a suite's in
`suites/nieh_columns.py` or `suites/episodes.py`; and `docs/formats.md`.
"""

from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple

from infthor_eval.runs import UnitRecord


class SampleColumn(NamedTuple):
    """A column.

    Attributes:
        name: its name; docs/formats.md says what it holds, in which unit.
        cell_type: type of its cells: str, int, float or bool.
        value: returns the cell of a record; None for an empty one.
    """

    name: str
    cell_type: type
    value: Callable[[UnitRecord[Any]], str | float | bool | None]


def payload_column(name: str, cell_type: type) -> SampleColumn:
    """Return the column of a field of the payload."""
    return SampleColumn(name, cell_type, attrgetter(f"payload.{name}"))


ENVELOPE = (
    SampleColumn("task", str, lambda record: record.task),
    SampleColumn("id", str, lambda record: record.id),
    SampleColumn("variant", str, lambda record: record.variant),
    SampleColumn("repeat", int, lambda record: record.repeat),
    SampleColumn("cluster", str, lambda record: record.cluster),
    SampleColumn("attempt", int, lambda record: record.attempt),
    SampleColumn("state", str, lambda record: record.state),
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
