"""Tables of runs of episodes: what plans and manipulation have in common."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from infthor_eval.episodes.summary import EpisodeTaskSummary
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, left_out_notes

NAME_COLUMNS = (Column("model", False), Column("task", False))
_EMBEDDED = (
    "Made in the embedded simulator: not comparable with the published rows, which are of AI2-THOR "
    "in Unity."
)

T = TypeVar("T", bound=EpisodeTaskSummary)


def named_tasks(runs: Sequence[RunSummary]) -> Iterator[tuple[str, str, Any]]:
    """Yield each run's name, each task's name, and its results (`EpisodeTaskSummary`)."""
    for run in runs:
        for task_name, task in run.summary.tasks.items():
            yield run.header.label, task_name, task


def endings_table(
    title: str,
    tasks: Sequence[tuple[str, str, T]],
    column: str = "",
    value: Callable[[T], Any] = str,
) -> Table:
    """Return the table of how episodes ended; with a heading, a last column of values by task."""
    endings = list(dict.fromkeys(ending for _, _, task in tasks for ending in task.endings))
    further = [column] if column else []
    rows = []
    for *names, task in tasks:
        counts = [str(task.endings.get(ending, 0)) for ending in endings]
        rows.append(Row((*names, *counts, *([str(value(task))] if column else []))))
    return Table(title, (*NAME_COLUMNS, *map(Column, (*endings, *further))), tuple(rows))


def result_notes(runs: Sequence[RunSummary]) -> tuple[str, ...]:
    """Return the notes below results: on the embedded simulator, and on what was left out."""
    notes = [_EMBEDDED] if any(run.summary.simulator == "embedded" for run in runs) else []
    left_out = []
    for run in runs:
        left_out.append([(task.excluded, task.skipped) for task in run.summary.tasks.values()])
    return (*notes, *left_out_notes(left_out))
