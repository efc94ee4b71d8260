"""NIEH results as tables on the terminal."""

from collections.abc import Sequence
from typing import Any

from rich import box
from rich.table import Table

from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.report.comparison import Comparison
from infthor_eval.report.nieh_results import CLUE_COLUMNS, published_table4

__all__ = ["comparison_table", "nieh_table"]


def nieh_table(summaries: Sequence[dict[str, Any]]) -> Table:
    """Accuracy in percent by number of clues: a row per run, task and scorer, then the published numbers.

    Args:
        summaries: what `infthor_eval.report.nieh_results.summarise` gave for each run.
    """
    table = Table(box=box.SIMPLE_HEAD, title="NIEH accuracy, % by number of clues", title_justify="left")
    for name in ("model", "task", "scorer"):
        table.add_column(name)
    for name in (*CLUE_COLUMNS, "± 95 %", "n", "failed"):
        table.add_column(name, justify="right")
    for summary in summaries:
        for task, result in summary["tasks"].items():
            for scorer in SCORERS:
                table.add_row(summary["run"]["model"]["name"], task, scorer, *_cells(result["by_clues"], scorer))
        table.add_section()
    published = published_table4()
    for name, row in published.rows.items():
        table.add_row(
            name,
            f"published, {published.context}",
            published.scorer,
            *map("{:.2f}".format, row),
            "",
            "",
            style="dim",
        )
    if any(_simulated(summary) for summary in summaries):
        table.caption = (
            "Questions on frames of the embedded simulator: not comparable with the published rows, which are on "
            "AI2-THOR's own frames."
        )
        table.caption_justify = "left"
    return table


def _cells(by_clues: dict[str, Any], scorer: str) -> list[str]:
    total = by_clues["total"]
    means = [f"{100 * by_clues[name][scorer]['mean']:.2f}" if by_clues[name]["n"] else "-" for name in CLUE_COLUMNS]
    high, mean = total[scorer]["high"], total[scorer]["mean"]
    reach = "-" if high is None else f"{100 * (high - mean):.2f}"  # one trajectory alone tells nothing about others
    return [*means, reach, str(total["n"]), str(total["n_failed"])]


def _simulated(summary: dict[str, Any]) -> bool:
    return any(task["simulator"] == "embedded" for task in summary["run"]["tasks"].values())


def comparison_table(rows: Sequence[Comparison], first: str, second: str) -> Table:
    """Differences in percentage points: a row per task and scorer.

    Args:
        rows: what `compare` found.
        first: the first run's model.
        second: the second run's model.
    """
    table = Table(box=box.SIMPLE_HEAD, title=f"{second} against {first}, accuracy in %", title_justify="left")
    for name in ("task", "scorer"):
        table.add_column(name)
    for name in ("first", "second", "difference", "95 % interval", "p", "questions", "only in one"):
        table.add_column(name, justify="right")
    for row in rows:
        estimate, p = row.difference.estimate, row.difference.p
        interval = significance = "-"  # one trajectory alone tells nothing about others
        if estimate.low is not None and estimate.high is not None and p is not None:
            interval, significance = f"[{100 * estimate.low:+.2f}, {100 * estimate.high:+.2f}]", f"{p:.4f}"
        table.add_row(
            row.task,
            row.scorer,
            f"{100 * row.first:.2f}",
            f"{100 * row.second:.2f}",
            f"{100 * estimate.mean:+.2f}",
            interval,
            significance,
            str(estimate.n),
            str(row.n_unshared),
        )
    return table
