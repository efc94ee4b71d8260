"""Runs whose records were made elsewhere: stored with a journal and results like any other run."""

from collections.abc import Sequence
from pathlib import Path

from infthor_eval.formats.digests import fingerprint
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import P, RunHeader, U, UnitRecord
from infthor_eval.runs.results import results_document, write_results, write_scores, write_usage
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
    folder = output / header.name / f"{'+'.join(header.config['tasks'])[:80]}-{fingerprint(header.config)}"
    with Journal(folder, header, suite.records) as journal:
        for record in records:
            if journal.find_record(record.key, record.fingerprint) is None:
                journal.append(record)
        summary = RunSummary(header, suite.summarise(header, records))
        usage = Usage.total(record.usage for record in records)
        write_results(folder, results_document(summary, suite, n_missing, usage))
        write_scores(folder, suite, records)
        write_usage(folder, records, usage)
    return folder, summary
