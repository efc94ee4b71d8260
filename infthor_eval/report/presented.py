"""Runs with the presenter of their suite, as the page and the table of samples show them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import UsageError
from infthor_eval.report.presenter import Presenter
from infthor_eval.report.runs import ReportRun, distinct_names, with_frames
from infthor_eval.runs import UnitRecord, count_units, mark_incomplete, read_header
from infthor_eval.runs.completeness import count_missing
from infthor_eval.runs.journals.shards import Tell, read_run_log
from infthor_eval.runs.stored.command import read_stored_command
from infthor_eval.runs.stored.search import read_results
from infthor_eval.suites import find_presenter, find_suite


@dataclass(frozen=True, kw_only=True)
class PresentedRun(ReportRun):
    """A run with the presenter of its suite."""

    presenter: Presenter

    def main_score(self, record: UnitRecord[Any]) -> float:
        """Return the score that decides whether a unit is right, 1 being right."""
        scores = self.suite.scores(record)
        main = self.presenter.main_metric
        if main is None:
            return next(iter(scores.values()), 0.0)
        return scores.get(main, max(scores.values(), default=0.0))

    def outcome(self, record: UnitRecord[Any]) -> str:
        """Return how a unit ended: "right", "partly", "wrong", "failed", "not asked" or
        "excluded"."""
        if record.state != "answered":
            return record.state
        score = self.main_score(record)
        return "right" if score >= 1 else "partly" if score > 0 else "wrong"


def read_report_runs(
    folders: Sequence[Path], tell: Tell | None = None, *, twice: bool = False
) -> list[PresentedRun]:
    """Read runs from their folders, at least one.

    Args:
        folders: the folders.
        tell: told of bad lines of journals, see `read_run`.
        twice: whether a folder may be given twice.

    Raises:
        UsageError: a folder is given twice, or the suite of a run is not known here.
        DataError: a folder has no journal, or it cannot be read.
    """
    if not twice and len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    headers = [read_header(folder) for folder in folders]
    names = distinct_names(folders, headers)
    return [
        read_report_run(folder, header.suite, name, tell)
        for folder, header, name in zip(folders, headers, names, strict=True)
    ]


def read_report_run(
    folder: Path, suite_name: str, name: str, tell: Tell | None = None
) -> PresentedRun:
    """Read a run of a suite by the name that it has beside others (`distinct_names`).

    Raises:
        UsageError: the suite is not known here.
        DataError: the folder has no journal, or it cannot be read.
    """
    suite = find_suite(suite_name)
    header, log = read_run_log(folder, suite.records, tell)
    results = read_results(folder)
    command = read_stored_command(folder)
    n_missing = count_missing(header, len(log.records))
    if n_missing is None and results is not None:
        n_missing = results.n_missing
    units = count_units(header, log.records)
    name = mark_incomplete(name, units, n_missing)
    return PresentedRun(
        folder=folder,
        label=with_frames(name, header),
        model=with_frames(mark_incomplete(header.name, units, n_missing), header),
        suite=suite,
        presenter=find_presenter(suite_name),
        header=msgspec.structs.replace(header, name=name),
        records=tuple(log.records),
        usage=log.usage,
        n_missing=n_missing,
        command=command.line if command else "",
        data=command.data if command else None,
    )
