"""Runs as a table with a row for each of their tasks, for notebooks."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from infthor_eval.rates import Rate
from infthor_eval.runs.stored.labels import label_runs
from infthor_eval.runs.stored.search import StoredRun, find_runs

if TYPE_CHECKING:
    from pandas import DataFrame


def load_runs(*folders: str | os.PathLike[str]) -> DataFrame:
    """See `infthor_eval.load_runs`."""
    import pandas

    stored = []
    for run in chain.from_iterable(find_runs(Path(one), warnings.warn) for one in folders):
        if isinstance(run, StoredRun):
            stored.append(run)
        else:
            warnings.warn(f"{run.folder}: cannot be read: {run.reason}", stacklevel=2)
    labels = label_runs([(run.folder, run.header) for run in stored])
    rows = [row for label, run in zip(labels, stored, strict=True) for row in _rows(label, run)]
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


def _rows(label: str, run: StoredRun) -> Iterator[dict[str, Any]]:
    usage = run.usage
    is_whole = run.n_failed == 0 and run.n_not_asked == 0
    of_run = {
        "run": label,
        "suite": run.header.suite,
        "state": "whole" if is_whole else "incomplete",
        "answered": run.n_answered,
        "failed": run.n_failed,
        "not_asked": run.n_not_asked,
        "requests": usage.requests,
        "tokens_read": usage.context,
        "tokens_cached": usage.cached,
        "tokens_written": usage.reply,
        "cost": usage.cost,
        "changed": datetime.fromtimestamp(run.changed, UTC),
        "folder": str(run.folder),
    }
    for task in run.header.config.tasks:
        rate = run.primary_metrics.get(task)
        yield {**of_run, "task": task, **({} if rate is None else _scores(rate))}


def _scores(rate: Rate) -> dict[str, Any]:
    return {"score": rate.mean, "low": rate.low, "high": rate.high, "n": rate.n}
