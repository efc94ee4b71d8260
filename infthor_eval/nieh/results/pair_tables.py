"""Tables of pairs of twins: net pairs, what the replies to twins were, and the memory curves."""

from collections.abc import Iterator, Sequence

from infthor_eval.facets import Facet, facet_table
from infthor_eval.nieh.results.pair_summary import PAIR_FACETS, PairSummary, TwinRecords
from infthor_eval.nieh.results.retention import Kept, Retention
from infthor_eval.nieh.results.summary import named_tasks
from infthor_eval.rates import Rate, format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, TableCell

_HEADS = (Column("model", False), Column("task", False), Column("context", False))
_NOTES = (
    "net pairs: pairs right (both worlds' answers) less pairs exchanged (each answer right in the "
    "other world), %; 0 on average for a model that does not know which world is which. "
    "In brackets: 95 % bootstrap interval over the trajectories that the worlds were made of; all "
    "equal: each of them has this value, so resampling them finds no interval.",
    "by fact: net pairs, as a mean over changed facts, as several pairs may be about one. flipped: "
    "pairs with two different replies; right then: of these, pairs right. one right: pairs right "
    "in one world alone; commoner: of these, how often the right answer is the commoner one of its "
    "form (prior knowledge). placebo: of pairs whose frames differ and whose answers do not, both "
    "right. single: answers with full marks, while the task's accuracy counts partly right lists, "
    "too. bases: trajectories that the worlds were made of.",
)


_KEPT = (
    "What is left of the net pairs at the first age: from each age to the next, the ratio of net "
    "pairs of the questions asked at both (in parentheses: their number), multiplied. half-life: "
    "the ages between which it passes one half, in brackets the 95 % bootstrap interval over "
    "trajectories.",
)
_Found = tuple[str, str, str, PairSummary]  # model, task, context, pairs


def pair_overview(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of tasks that have pairs, if there are any."""
    rows = tuple(
        Row((run, task, context, *_cells(pairs))) for run, task, context, pairs in _find(runs)
    )
    names = (
        *("net pairs", "right", "exchanged", "by fact", "single", "flipped", "right then"),
        *("one right", "commoner", "placebo", "n", "facts", "bases"),
    )
    columns = (*_HEADS, *map(Column, names))
    return [Table("Twins: net pairs, %, strict scorer", columns, rows, _NOTES)] if rows else []


def pair_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of pairs, those by kind and type, and the memory curves; none without."""
    found = list(_find(runs))
    if not found:
        return []
    by_facet = [table for facet in PAIR_FACETS for table in _grouped(facet, found)]
    return [*pair_overview(runs), *_retention(found), *by_facet]


def _retention(found: Sequence[_Found]) -> list[Table]:
    """Return the table of what is left of each memory by age; none without questions at moments."""
    kept = [(names, pairs.retention) for *names, pairs in found if pairs.retention is not None]
    ages = sorted({it.age for _, retention in kept for it in retention.kept})
    rows = []
    for names, retention in kept:
        by_age = {it.age: it for it in retention.kept}
        cells = [_kept_cell(by_age.get(age)) for age in ages]
        rows.append(Row((*names, *cells, half_life_text(retention))))
    columns = (*_HEADS, *(Column(f"{age} frames") for age in ages), Column("half-life, frames"))
    return (
        [Table("Twins: what is left of net pairs, %", columns, tuple(rows), _KEPT)] if rows else []
    )


def _kept_cell(kept: Kept | None) -> TableCell:
    rate = None if kept is None else Rate(kept.share, kept.low, kept.high, kept.n)
    return _grouped_cell(rate)


def half_life_text(retention: Retention) -> str:
    """Return between which ages the half is passed, and the interval of when."""
    if retention.half_life is None:
        return "- (nothing at first)"
    first, second = retention.half_life
    bracket = f"> {first}" if second is None else f"{first} to {second}"
    if retention.low is None and retention.high is None:
        return bracket
    low, high = (
        f"> {retention.kept[-1].age}" if end is None else f"{end:.0f}"
        for end in (retention.low, retention.high)
    )
    return f"{bracket} [{low}, {high}]"


def _find(runs: Sequence[RunSummary]) -> Iterator[_Found]:
    for run, name, task in named_tasks(runs):
        if task.pairs is not None:
            yield run, name, task.context, task.pairs


def _cells(pairs: PairSummary) -> tuple[TableCell | str, ...]:
    """Return the numbers of a row; the intervals of all but the first are in files alone."""
    rates = (
        pairs.pair_accuracy,
        pairs.pairs_exchanged,
        pairs.by_fact,
        pairs.single,
        pairs.flipped,
        pairs.right_when_flipped,
        pairs.one_right,
        pairs.one_is_commoner,
        pairs.placebo,
    )
    numbers = (pairs.n_pairs, pairs.n_facts, pairs.n_trajectories)
    return (format_percent(pairs.net_pairs), *map(_mean_cell, rates), *map(str, numbers))


def _mean_cell(rate: Rate | None) -> TableCell:
    cell = format_percent(rate)
    return TableCell(cell.numbers[""] or "-", cell.numbers)


def _grouped(facet: Facet[TwinRecords], found: Sequence[_Found]) -> list[Table]:
    return facet_table(
        f"Twins: net pairs, % by {facet.heading} (pairs)",
        [column.name for column in _HEADS],
        facet.in_order(name for *_, pairs in found for name in pairs.by[facet.name]),
        [(names, pairs.by[facet.name]) for *names, pairs in found],
        _grouped_cell,
        ("In brackets: 95 % bootstrap interval over trajectories; in parentheses: pairs.",),
    )


def _grouped_cell(rate: Rate | None) -> TableCell:
    cell = format_percent(rate)
    if rate is None:
        return TableCell(cell, {**cell.numbers, "pairs": ""})
    return TableCell(f"{cell} ({rate.n})", {**cell.numbers, "pairs": str(rate.n)})
