"""Runs as a table with a row for each of their tasks, for notebooks."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from infthor_eval.rates import Rate
from infthor_eval.run import Run, find_runs, with_distinct_names
from infthor_eval.runs import NOTHING

if TYPE_CHECKING:
    from pandas import DataFrame


def load_runs(*folders: str | os.PathLike[str]) -> DataFrame:
    """See `infthor_eval.load_runs`."""
    import pandas

    stored = []
    for run in chain.from_iterable(find_runs(Path(one), warnings.warn) for one in folders):
        if isinstance(run, Run):
            stored.append(run)
        else:
            warnings.warn(f"{run.folder}: cannot be read: {run.reason}", stacklevel=2)
    rows = [row for run in with_distinct_names(stored) for row in _rows(run)]
    return pandas.DataFrame(rows, columns=_COLUMNS)


_COLUMNS = [
    "run",
    "suite",
    "task",
    "state",
    "score",
    "low",
    "high",
    "n",
    "answered",
    "failed",
    "not_asked",
    "requests",
    "tokens_read",
    "tokens_cached",
    "tokens_written",
    "cost",
    "changed",
    "folder",
]


def _rows(run: Run) -> Iterator[dict[str, Any]]:
    usage = run.results.usage if run.results else NOTHING
    is_whole = run.states["failed"] == 0 and run.n_not_asked == 0
    of_run = {
        "run": run.label,
        "suite": run.listed.suite,
        "state": "whole" if is_whole else "incomplete",
        "answered": run.states["answered"],
        "failed": run.states["failed"],
        "not_asked": run.n_not_asked,
        "requests": usage.requests,
        "tokens_read": usage.context,
        "tokens_cached": usage.cached,
        "tokens_written": usage.reply,
        "cost": usage.cost,
        "changed": run.changed,
        "folder": str(run.folder),
    }
    for task in run.listed.config.tasks:
        rate = run.primary_metrics.get(task)
        yield {**of_run, "task": task, **({} if rate is None else _scores(rate))}


def _scores(rate: Rate) -> dict[str, Any]:
    return {"score": rate.mean, "low": rate.low, "high": rate.high, "n": rate.n}
