"""NIEH results as tables on the terminal."""

from collections.abc import Iterator, Sequence
from typing import Any

from rich import box
from rich.table import Table

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.report.comparison import Comparison
from infthor_eval.report.nieh_results import CLUE_COLUMNS, PublishedRow, PublishedTable, published_table4

__all__ = ["answers_table", "comparison_table", "depth_table", "nieh_table"]


def nieh_table(summaries: Sequence[dict[str, Any]]) -> Table:
    """Accuracy in percent by number of clues: a row per run, task and scorer, then the published numbers.

    Args:
        summaries: what `infthor_eval.report.nieh_results.summarise` gave for each run.
    """
    table = Table(box=box.SIMPLE_HEAD, title="NIEH accuracy, % by number of clues", title_justify="left")
    for name in ("model", "task", "scorer"):
        table.add_column(name, no_wrap=True, overflow="fold")
    for name in (*CLUE_COLUMNS, "± 95 %", "bootstrap", ABSENCE, "n", "left out", "failed"):
        table.add_column(name, justify="right", overflow="fold")
    for summary in summaries:
        for task, result in summary["tasks"].items():
            for scorer in SCORERS:
                table.add_row(summary["run"]["model"]["name"], task, scorer, *_cells(result, scorer))
        table.add_section()
    published = published_table4()
    for name, row in published.rows.items():
        cells = [f"{value:.2f}" for value in row.values]
        table.add_row(name, f"published, {published.context}", published.scorer, *cells, style="dim")
        for summary in summaries:
            for task, cells in _differences(summary, row, published):
                table.add_row("  ours minus published", task, published.scorer, *cells)
    if any(_simulated(summary) for summary in summaries):
        table.caption = (
            "Questions on frames of the embedded simulator: not comparable with the published rows, which are on "
            "AI2-THOR's own frames."
        )
        table.caption_justify = "left"
    return table


def _cells(result: dict[str, Any], scorer: str) -> list[str]:
    by_clues = result["by_clues"]
    total = by_clues["total"]
    means = [_mean(by_clues[name], scorer) for name in CLUE_COLUMNS]
    # One trajectory alone tells nothing about others: no interval.
    known = total["n"] > 0 and total[scorer]["high"] is not None
    reach = f"{100 * (total[scorer]['high'] - total[scorer]['mean']):.2f}" if known else "-"
    resampled = total[scorer]["bootstrap"] if total["n"] else None
    interval = "{:.1f}–{:.1f}".format(*(100 * end for end in resampled)) if resampled else "-"
    counts = [str(total["n"]), str(result["left_out"]["n"]), str(total["n_failed"])]
    return [*means, reach, interval, _mean(by_clues[ABSENCE], scorer), *counts]


def _mean(cell: dict[str, Any], scorer: str) -> str:
    return f"{100 * cell[scorer]['mean']:.2f}" if cell["n"] else "-"


def _differences(
    summary: dict[str, Any], row: PublishedRow, published: PublishedTable
) -> Iterator[tuple[str, list[str]]]:
    """How far a run of the published model is from its row, and whether its interval (=) holds the published value."""
    if summary["run"]["model"]["name"] != row.model:
        return
    for task, about in summary["run"]["tasks"].items():
        # Frames that a simulator of ours rendered are another data set.
        if about["config"]["dataset_kwargs"]["context"] != published.context or about["simulator"] is not None:
            continue
        by_clues = summary["tasks"][task]["by_clues"]
        yield (
            task,
            [
                _difference(by_clues[name], value, published)
                for name, value in zip(CLUE_COLUMNS, row.values, strict=True)
            ],
        )


def _difference(cell: dict[str, Any], value: float, published: PublishedTable) -> str:
    if not cell["n"]:
        return "-"
    ours = cell[published.scorer]
    within = ours["low"] is not None and 100 * ours["low"] <= value <= 100 * ours["high"]
    return f"{100 * ours['mean'] - value:+.2f}{' =' if within else ''}"


def _simulated(summary: dict[str, Any]) -> bool:
    return any(task["simulator"] == "embedded" for task in summary["run"]["tasks"].values())


def depth_table(summaries: Sequence[dict[str, Any]]) -> Table | None:
    """Accuracy in percent by depth of the needle: a row per run, haystack task and scorer; None without any."""
    variants = {name for summary in summaries for task in summary["tasks"].values() for name in task["by_variant"]}
    depths = sorted(name for name in variants if name.startswith("depth="))
    if not depths:
        return None
    table = Table(box=box.SIMPLE_HEAD, title="Accuracy, % by depth of the needle (questions)", title_justify="left")
    for name in ("model", "task", "scorer"):
        table.add_column(name, no_wrap=True, overflow="fold")
    for depth in depths:
        table.add_column(depth, justify="right")
    for summary in summaries:
        for task, result in summary["tasks"].items():
            if set(depths) & set(result["by_variant"]):
                for scorer in SCORERS:
                    cells = [_at_depth(result["by_variant"].get(depth), scorer) for depth in depths]
                    table.add_row(summary["run"]["model"]["name"], task, scorer, *cells)
    return table


def _at_depth(found: dict[str, Any] | None, scorer: str) -> str:
    return f"{100 * found[scorer]['mean']:.2f} ({found['n']})" if found else "-"


def answers_table(summaries: Sequence[dict[str, Any]]) -> Table:
    """The form of the replies: a leaning to yes, and replies that are no answer; a row per run and task."""
    table = Table(box=box.SIMPLE_HEAD, title="Form of the replies", title_justify="left")
    for name in ("model", "task"):
        table.add_column(name, no_wrap=True, overflow="fold")
    for name in ("yes/no questions", "gold yes, %", "said yes, %", "not in the form asked for"):
        table.add_column(name, justify="right")
    for summary in summaries:
        for task, result in summary["tasks"].items():
            asked, failures = result["yes_no"], result["format_failures"]
            shares = [_percent(asked[name]) for name in ("share_gold_yes", "share_said_yes")]
            said = ", ".join(f"{n} {reason}" for reason, n in failures.items()) or "-"
            table.add_row(summary["run"]["model"]["name"], task, str(asked["n"]), *shares, said)
    return table


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f}"


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
