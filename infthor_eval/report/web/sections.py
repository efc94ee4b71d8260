"""Parts of a page as values: sections with charts and tables."""

from dataclasses import dataclass

from infthor_eval.report.charts import Chart
from infthor_eval.tables import Table


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        key: anchor of links to the section; letters and hyphens.
        title: heading of the section.
        charts: charts, above the tables.
        tables: tables with the numbers.
        notes: remarks, a paragraph each.
        lead: what it says, in sentences, above all else.
        is_sortable: whether a click on a column's heading sorts its tables.
        is_linked: whether the head of the page has a link to it; parts of another section have
            none.
    """

    key: str
    title: str
    charts: tuple[Chart, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    lead: str = ""
    is_sortable: bool = False
    is_linked: bool = True

    @property
    def is_empty(self) -> bool:
        """Whether the section has no contents."""
        return not (self.charts or self.tables or self.notes)
