"""Runs whose records were made elsewhere: stored with a journal and results like any other run."""

from collections.abc import Sequence
from pathlib import Path

from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import P, RunHeader, U, UnitRecord
from infthor_eval.runs.request import run_folder
from infthor_eval.runs.results import write_run_files
from infthor_eval.runs.suite import RunSummary, Suite
from infthor_eval.runs.usage import Usage

__all__ = ["store_run"]


def store_run(
    output: Path, header: RunHeader, suite: Suite[U, P], records: Sequence[UnitRecord[P]], n_missing: int
) -> tuple[Path, RunSummary]:
    """Write journal and results of a run, and return its folder `<output>/<name>/<tasks>-<config hash>` and summary.

    Records that the journal has already are not written again.

    Args:
        output: folder above those of runs.
        header: header of the run.
        suite: suite of the run.
        records: all its records.
        n_missing: number of its units without a record.

    Raises:
        UsageError: another process writes the run.
        DataError: the journal has a bad line, or something cannot be written.
    """
    folder = run_folder(output, header, header.config["tasks"])
    with Journal(folder, header, suite.records) as journal:
        for record in records:
            if journal.find_record(record.key, record.fingerprint) is None:
                journal.append(record)
        summary = RunSummary(header, suite.summarise(header, records))
        write_run_files(folder, summary, suite, records, n_missing, Usage.total(record.usage for record in records))
    return folder, summary
