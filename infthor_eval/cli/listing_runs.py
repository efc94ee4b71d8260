"""What `ls runs` shows."""

import time
from collections.abc import Iterator
from pathlib import Path

from infthor_eval.cli.progress import say
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.runs.run_search import BrokenRun, StoredRun, find_runs
from infthor_eval.tables import Column, Row, Table
from infthor_eval.terminal import print_line

__all__ = ["runs"]

_MOST = 3  # tasks that a row tells the number of
_AGES = ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s"))
_NUMBERS = ("done", "missing", "failed")


def runs(folder: Path) -> None:
    """Print the runs below a folder; those that cannot be read are named.

    Raises:
        DataError: there is no such folder.
    """
    found = list(find_runs(folder))
    whole = [item for item in found if isinstance(item, StoredRun)]
    if not found:
        print_line(f"no runs in {folder}; infthor-eval --model MODEL --tasks TASKS makes one")
    if whole:
        columns = (Column("run", False), Column("suite", False), *map(Column, _NUMBERS))
        more = (Column("tasks, %", False), Column("age"), Column("folder", False))
        rows = tuple(Row(tuple(_cells(item))) for item in whole)
        print_table(Table("", (*columns, *more), rows), table_console())
    for item in found:
        if isinstance(item, BrokenRun):
            say(f"{item.folder}: cannot be read: {item.reason}", "red")


def _cells(run: StoredRun) -> Iterator[str]:
    yield run.header.name
    yield run.header.suite
    yield from (str(run.n_done), "?" if run.n_missing is None else str(run.n_missing), str(run.n_failed))
    yield _numbers(run)
    yield _age(time.time() - run.changed)
    yield str(run.folder)


def _numbers(run: StoredRun) -> str:
    """The tasks, each with the number that it is known by, as far as a row has room."""
    tasks = list(run.header.identity.get("tasks", {}))
    told = [
        f"{task} {100 * run.primary_metrics[task].mean:.1f}" if task in run.primary_metrics else task
        for task in tasks[:_MOST]
    ]
    return ", ".join([*told, *([f"{len(tasks) - _MOST} more"] if len(tasks) > _MOST else [])])


def _age(seconds: float) -> str:
    size, unit = next((pair for pair in _AGES if seconds >= pair[0]), _AGES[-1])
    return f"{max(0, seconds) / size:.0f} {unit}"
