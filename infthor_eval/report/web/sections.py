"""What a page is made of, before it is known how it looks."""

from dataclasses import dataclass

from infthor_eval.tables import Table

__all__ = ["Chart", "Section"]


@dataclass(frozen=True)
class Chart:
    """A picture.

    Attributes:
        title: above it.
        svg: the picture, to stand in the page.
        told: what it shows, in words, for those who do not see it.
    """

    title: str
    svg: str
    told: str


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        key: of links to it; letters and hyphens.
        title: its heading.
        charts: above the tables.
        tables: with the numbers.
        notes: what must be said, a paragraph each.
    """

    key: str
    title: str
    charts: tuple[Chart, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing in it."""
        return not (self.charts or self.tables or self.notes)
