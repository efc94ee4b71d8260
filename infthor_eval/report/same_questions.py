"""Runs compared across tasks, on the questions that they share.

A question is known by its id, its trajectory, its words and its gold answers, so that it is the
same one in `nieh_gt`, in `nieh_full` and at each depth. What a run has of one task, at one depth,
is a side; each is compared with each, or with those of one run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.report.comparison import Comparison, compare, p_cell
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord
from infthor_eval.tables import Column, Row, Table, interval_cell

_TASK = "same questions"  # the one task that the sides of a comparison are of

Record = UnitRecord[Any]


@dataclass(frozen=True)
class Side:
    """What a run has of one task, in one variant of it (a depth).

    Attributes:
        run: place of the run among those that are compared.
        task: name of the task.
        variant: the variant.
        label: names of run, task and variant.
        records: records of the units, all of one task, known by their questions.
    """

    run: int
    task: str
    variant: str
    label: str
    records: Sequence[Record]


@dataclass(frozen=True)
class ComparedSides:
    """How two sides differ in one metric after the other."""

    first: Side
    second: Side
    comparisons: Sequence[Comparison]


def find_sides(runs: Sequence[Run]) -> list[Side]:
    """Return the sides of runs of one suite, in the order of runs, tasks and variants."""
    sides = []
    for number, run in enumerate(runs):
        records: dict[tuple[str, str], list[Record]] = {}
        for record in run.records:
            records.setdefault((record.task, record.variant), []).append(_by_question(run, record))
        for (task, variant), same in sorted(records.items()):
            name = run.label.replace(f" ({task})", "")  # runs of one name are told apart by it
            label = ", ".join(filter(None, (name, task, variant)))
            sides.append(Side(number, task, variant, label, same))
    return sides


def _by_question(run: Run, record: Record) -> Record:
    """Return a record whose key is the question alone."""
    title, target, *_ = run.presenter.describe(record)
    question = msgspec.json.encode((record.id, title, target)).decode()
    return msgspec.structs.replace(record, task=_TASK, id=question, variant="")


def compare_sides(
    runs: Sequence[Run], sides: Sequence[Side], against: int | None = None
) -> list[ComparedSides]:
    """Compare sides on the questions that both have a result of, the later one less the earlier.

    Args:
        runs: the runs, of one suite.
        sides: their sides.
        against: place of the run that all others are compared with; None for each with each.
    """
    suite = runs[0].suite
    presenter = runs[0].presenter
    compared = []
    for first, second in _pairs(sides, against):
        try:
            comparisons = compare(suite, presenter, first.records, second.records)
        except DataError:  # they share none; others may
            continue
        compared.append(ComparedSides(first, second, comparisons))
    if not compared:
        raise DataError(
            "the runs share no question with a result in two of them; compare runs on the same data"
        )
    return compared


def _pairs(sides: Sequence[Side], against: int | None) -> Iterator[tuple[Side, Side]]:
    if against is None:
        yield from combinations(sides, 2)
        return
    bases = [side for side in sides if side.run == against]
    others = [side for side in sides if side.run != against]
    yield from product(bases, others)


def sides_table(compared: Sequence[ComparedSides]) -> Table:
    """Return a table with a row for each pair of sides and metric."""
    names = ("run", "against", "metric", "unit")
    numbers = ("run", "against", "difference", "95 % interval", "p", "shared", "not in both")
    rows = [
        row
        for pair in compared
        for number, comparison in enumerate(pair.comparisons, 1)
        for row in [_row(pair, comparison, ends=number == len(pair.comparisons))]
    ]
    notes = [
        "difference: run less against, on the shared questions, which both have a result of. "
        "Paired by question; interval and p are clustered by trajectory."
    ]
    if len(compared) > 1:
        notes.append(
            f"p: of each pair by itself. Of {len(compared)} pairs that do not differ, one in 20 "
            "has a p below 0.05."
        )
    columns = (*(Column(name, False) for name in names), *map(Column, numbers))
    return Table("On the questions that they share", columns, tuple(rows), tuple(notes))


def _row(pair: ComparedSides, comparison: Comparison, *, ends: bool) -> Row:
    unit, factor = ("%", 100.0) if comparison.is_share else ("points", 1.0)
    estimate = comparison.difference.estimate
    low, high = (None if end is None else factor * end for end in (estimate.low, estimate.high))
    cells = (
        *(pair.second.label, pair.first.label, comparison.metric, unit),
        f"{factor * comparison.second:.2f}",
        f"{factor * comparison.first:.2f}",
        f"{factor * estimate.mean:+.2f}",
        interval_cell(low, high, "+.2f"),
        p_cell(comparison.difference.p),
        str(estimate.n),
        str(comparison.n_unshared),
    )
    return Row(cells, ends_section=ends)
