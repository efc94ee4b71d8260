"""The page of rows: one file, no network, no script or style but its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from infthor_eval.pages.one_file import LOOK, THEME, read_part, write_page_file
from infthor_eval.rates import Rate

_read = partial(read_part, __package__)


@dataclass(frozen=True, kw_only=True)
class LeaderboardRow:
    """A model on a task.

    Attributes:
        model: `developer/name`, or the name in a published table.
        revision: commit of the checkpoint, or dated name of a served model.
        task: task, or column of a published table.
        shown: what the model saw: context, memory and budget.
        frames: what rendered the frames.
        pairs: net pairs of twins, -1 to 1; None if there are none.
        singles: single answers, 0 to 1.
        above: score above `blind`, at most 1; None if it is not known.
        scorer: scorer of the single answers.
        n: number of questions.
        failed: number of them without a reply, which count as wrong.
        tokens_read: tokens of a request, mean; None if they were not counted.
        tokens_written: tokens of a reply, mean; likewise.
        cost: US dollars of all requests; None if no prices were given.
        seconds: seconds for a question, mean; None if they are not known.
        engine: library or server that ran the model.
        date: day of the runs (YYYY-MM-DD); empty if it is not known.
        by: who submitted it, or where it was published.
        url: where more is said; empty for none.
        remarks: what is to be known of it.
        is_published: True for a number of the paper's authors, which nobody checked here.
    """

    model: str
    revision: str = ""
    task: str
    shown: str
    frames: str
    pairs: Rate | None = None
    singles: Rate | None = None
    above: Rate | None = None
    scorer: str = "strict"
    n: int | None = None
    failed: int = 0
    tokens_read: float | None = None
    tokens_written: float | None = None
    cost: float | None = None
    seconds: float | None = None
    engine: str = ""
    date: str = ""
    by: str = ""
    url: str = ""
    remarks: Sequence[str] = ()
    is_published: bool = False

    @property
    def link(self) -> str:
        """The address, if a browser may open it; a script in its place is none."""
        return self.url if self.url.startswith(("https://", "http://")) else ""

    @property
    def order(self) -> tuple[float, float, float, str]:
        """Key of the first order: pairs before all else, best first."""
        return -_mean(self.pairs), -_mean(self.above), -_mean(self.singles), self.model.lower()


def _mean(rate: Rate | None) -> float:
    return -2.0 if rate is None else rate.mean


def write_leaderboard(
    rows: Sequence[LeaderboardRow], path: Path, *, title: str, version: str, refused: int = 0
) -> int:
    """Write the page into a file and return its size in bytes; equal rows give equal bytes.

    Args:
        rows: the rows, in any order.
        path: the file.
        title: title of the page.
        version: version of the package that checked the rows.
        refused: number of submissions that were refused.
    """
    values = {
        "rows": sorted(rows, key=lambda row: row.order),
        "tasks": sorted({row.task for row in rows}),
        "title": title,
        "version": version,
        "refused": refused,
    }
    return write_page_file(
        path,
        _read("page.html"),
        values,
        style=[LOOK, _read("page.css")],
        script=[THEME, _read("page.js")],
        filters={"percent": _percent, "interval": _interval, "number": _number},
    )


def _percent(rate: Rate | None) -> str:
    return "–" if rate is None else f"{100 * rate.mean:.1f}"


def _interval(rate: Rate | None) -> str:
    if rate is None or rate.low is None or rate.high is None:
        return ""
    return f"{100 * rate.low:.1f} to {100 * rate.high:.1f}"


def _number(value: float | None, digits: int = 0) -> str:
    return "–" if value is None else f"{value:,.{digits}f}"
