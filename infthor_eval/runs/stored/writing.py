"""Runs made without a driver, as replies are there already: stored like any other run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.records import Payload, RunHeader, SuiteUnit, UnitRecord
from infthor_eval.runs.request import run_folder
from infthor_eval.runs.results import write_run_files
from infthor_eval.runs.suite import RunSummary, Session, Suite
from infthor_eval.runs.usage import Usage


@dataclass(frozen=True)
class Stored:
    """A run that was stored: its folder, its summary, and the usage of all requests."""

    folder: Path
    summary: RunSummary
    usage: Usage


def store_run(
    output: Path,
    header: RunHeader,
    suite: Suite[SuiteUnit, Payload],
    make_records: Callable[[Session[Payload]], Sequence[UnitRecord[Payload]]],
    n_missing: int,
) -> Stored:
    """Write journal and results of a run into its folder `<output>/<name>/<tasks>-<config hash>`.

    Records that the journal has already are not written again.

    Args:
        output: folder above those of runs.
        header: header of the run.
        suite: suite of the run.
        make_records: returns all its records, given the session of its journal.
        n_missing: number of its units without a record.
    """
    folder = run_folder(output, header, header.config.tasks)
    with Journal(folder, header, suite.records) as journal:
        records = make_records(journal)
        for record in records:
            if not _is_stored(record, journal):
                journal.append(record)
        usage = Usage.total(
            [record.usage for record in records]
            + [artifact.usage for artifact in journal.artifacts]
        )
        summary = RunSummary.of(suite, header, records)
        write_run_files(folder, summary, suite, records, n_missing, usage)
    return Stored(folder, summary, usage)


def _is_stored(record: UnitRecord[Payload], journal: Journal[Payload]) -> bool:
    """Return whether the journal's latest record of this unit says the same."""
    return any(
        (latest.fingerprint, latest.failure, latest.payload)
        == (record.fingerprint, record.failure, record.payload)
        for latest in journal.latest_records([record.key])
    )
