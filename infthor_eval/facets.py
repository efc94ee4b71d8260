"""Facets: by what the units of a suite are grouped, in summaries, tables, charts and samples.

A facet says once how a unit's class is told, and in which order classes stand. All else is a query:
the units of each class, their mean with its interval, a row or a dot for it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from infthor_eval.tables import Column, Row, Table

T = TypeVar("T")
V = TypeVar("V")


@dataclass(frozen=True)
class Facet(Generic[T]):
    """Classes of units.

    Attributes:
        name: its name: `by_NAME` in results.json, and a column of the table of samples.
        heading: what the classes are of, in words.
        class_of: returns the class of a unit; None if it is in none.
        classes: all classes in their order; none for that of their names.
    """

    name: str
    heading: str
    class_of: Callable[[T], str | None]
    classes: Sequence[str] = ()

    def split(self, units: Iterable[T]) -> dict[str, list[T]]:
        """Return the units of each class that has some, in the order of the classes."""
        groups: dict[str, list[T]] = {}
        for unit in units:
            name = self.class_of(unit)
            if name is not None:
                groups.setdefault(name, []).append(unit)
        return {name: groups[name] for name in self.in_order(groups)}

    def means(self, units: Iterable[T], mean: Callable[[Sequence[T]], V | None]) -> dict[str, V]:
        """Return the mean of each class, however it is taken, without those that have none."""
        means = {name: mean(same) for name, same in self.split(units).items()}
        return {name: value for name, value in means.items() if value is not None}

    def in_order(self, used: Iterable[str]) -> list[str]:
        """Return the classes that are used, in their order."""
        known = set(used)
        return [name for name in self.classes or sorted(known) if name in known]


def facet_table(
    title: str,
    heads: Sequence[str],
    classes: Sequence[str],
    rows: Sequence[tuple[Sequence[str], Mapping[str, V]]],
    cell: Callable[[V | None], str],
    notes: Sequence[str] = (),
) -> list[Table]:
    """Return the table of means by class, a row for each of `rows`; none without a row.

    Args:
        heads: headings of the first columns.
        rows: texts of the first columns, and means by class.
        cell: returns the cell of a mean; takes None where a row has no such class.
    """
    laid_out = tuple(Row((*names, *(cell(of.get(name)) for name in classes))) for names, of in rows)
    columns = (*(Column(head, False) for head in heads), *map(Column, classes))
    return [Table(title, columns, laid_out, tuple(notes))] if rows else []
