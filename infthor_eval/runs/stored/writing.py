"""Runs made without a driver, as replies are there already: stored like any other run."""

from collections.abc import Callable, Sequence
from pathlib import Path

from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.records import Payload, RunHeader, SuiteUnit, UnitRecord
from infthor_eval.runs.request import run_folder
from infthor_eval.runs.results import Stored, store_results
from infthor_eval.runs.suite import Session, Suite


def store_run(
    output: Path,
    header: RunHeader,
    suite: Suite[SuiteUnit, Payload],
    make_records: Callable[[Session[Payload]], Sequence[UnitRecord[Payload]]],
    n_missing: int,
) -> Stored[Payload]:
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
        return store_results(folder, suite, journal, records, n_missing)


def _is_stored(record: UnitRecord[Payload], journal: Journal[Payload]) -> bool:
    """Return whether the journal's latest record of this unit says the same."""
    return any(
        (latest.fingerprint, latest.failure, latest.payload)
        == (record.fingerprint, record.failure, record.payload)
        for latest in journal.latest_records([record.key])
    )
