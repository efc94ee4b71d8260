"""Runs as the page shows them: who they are, their records, and what they took."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import UsageError
from infthor_eval.report.curves import model_names, run_labels
from infthor_eval.runs import RunHeader, RunSummary, Suite, UnitKey, UnitRecord, Usage, read_header
from infthor_eval.runs.configuration import read_configuration
from infthor_eval.runs.run_search import read_results
from infthor_eval.runs.shards import read_shards

__all__ = ["ReportRun", "merged", "read_report_runs"]


@dataclass(frozen=True)
class ReportRun:
    """A run.

    Attributes:
        folder: its own.
        label: what it is called beside the others.
        model: what its model is called, alike in runs that differ in a setting alone.
        suite: whose run it is.
        header: who it is, with the label for its name where names alone would not tell the runs apart.
        records: of all its units.
        usage: what all its requests took.
        n_missing: units that were not come to; None where nobody has counted them.
        command: that runs it again; empty where it is not known.
        data: folder of its data set, where the command named one.
    """

    folder: Path
    label: str
    model: str
    suite: Suite
    header: RunHeader
    records: tuple[UnitRecord[Any], ...]
    usage: Usage
    n_missing: int | None
    command: str = ""
    data: Path | None = None

    @cached_property
    def summary(self) -> RunSummary:
        """What it found."""
        return RunSummary(self.header, self.suite.summarise(self.header, self.records))

    @property
    def tasks(self) -> Mapping[str, Any]:
        """What its identity says of its tasks, by name."""
        found: Mapping[str, Any] = self.header.config["tasks"]
        return found

    def dataset(self, task: str) -> Mapping[str, Any]:
        """What the task's file says of its data (`dataset_kwargs`)."""
        found = self.tasks[task].get("config", {}).get("dataset_kwargs", {})
        return found if isinstance(found, Mapping) else {}


def read_report_runs(folders: Sequence[Path], suite_named: Callable[[str], Suite]) -> list[ReportRun]:
    """Read runs from their folders.

    Args:
        folders: at least one, each once.
        suite_named: finds the suite of a run.

    Raises:
        UsageError: one is given twice.
        DataError: there is no journal in one, or it cannot be read.
    """
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise UsageError("one run is given twice; give each once")
    headers = [read_header(folder) for folder in folders]
    labels = run_labels(folders, model_names(headers))
    return [
        _read(folder, label, header, suite_named(header.suite))
        for folder, label, header in zip(folders, labels, headers, strict=True)
    ]


def _read(folder: Path, label: str, header: RunHeader, suite: Suite) -> ReportRun:
    log, results, asked = read_shards(folder, suite.records.decoder()), read_results(folder), read_configuration(folder)
    (model,) = model_names([header])
    return ReportRun(
        folder=folder,
        label=label,
        model=model,
        suite=suite,
        header=header if label == model else msgspec.structs.replace(header, name=label),
        records=tuple(log.records),
        usage=log.usage,
        n_missing=results.n_missing if results else None,
        command=asked.command if asked else "",
        data=asked.data if asked else None,
    )


def merged(runs: Sequence[ReportRun]) -> Mapping[UnitKey, list[UnitRecord[Any] | None]]:
    """Records by unit, a place per run, in the order of the units' keys."""
    found: dict[UnitKey, list[UnitRecord[Any] | None]] = {}
    for place, run in enumerate(runs):
        for record in run.records:
            found.setdefault(record.key, [None] * len(runs))[place] = record
    return dict(sorted(found.items()))
