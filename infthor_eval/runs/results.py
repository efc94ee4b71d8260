"""The files that a run writes beside its journal: results, scores and usage."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic

import msgspec

from infthor_eval.runs.journals.journal import Journal
from infthor_eval.runs.journals.records import Payload, SuiteUnit, UnitRecord
from infthor_eval.runs.suite import RunSummary, Suite
from infthor_eval.runs.usage import Usage
from infthor_eval.storage.files import write_output, writing_hint

RESULTS = "results.json"
_SCORES = "scores.jsonl"
_USAGE = "usage.json"


@dataclass(frozen=True)
class Stored(Generic[Payload]):
    """A run whose results are in its folder.

    Attributes:
        records: records of all units that were attempted.
        n_missing: number of units that were not attempted.
        usage: usage of all requests, those for cached artifacts included.
    """

    folder: Path
    summary: RunSummary
    records: Sequence[UnitRecord[Payload]]
    n_missing: int
    usage: Usage


def results_document(
    run: RunSummary, suite: Suite[Any, Any], n_missing: int | None, usage: Usage
) -> dict[str, Any]:
    """Return the contents of `results.json` (docs/formats.md); `n_missing` is None if unknown."""
    header = run.header
    return {
        "suite": header.suite,
        "name": header.name,
        "config": header.config,
        "n_missing": n_missing,
        "units": run.units,
        "primary_metrics": suite.primary_metrics(run.summary),
        "summary": _reproducible(run.summary),
        # Without cached tokens: their number differs between a run and the same run resumed, or run
        # by workers.
        "usage": {name: getattr(usage, name) for name in ("requests", "context", "reply", "cost")},
    }


def _reproducible(summary: Any) -> dict[str, Any]:
    """Return a summary as it says itself (`document`), or all its fields; without `took`, as times
    differ from run to run."""
    document = summary.document() if hasattr(summary, "document") else msgspec.to_builtins(summary)
    return {name: value for name, value in document.items() if name != "took"}


def store_results(
    folder: Path,
    suite: Suite[SuiteUnit, Payload],
    journal: Journal[Payload],
    records: Sequence[UnitRecord[Payload]],
    n_missing: int,
) -> Stored[Payload]:
    """Sum up records of a journal, and write results, scores and usage of the run.

    `results.json` is `results_document`; equal runs give equal bytes of it.
    """
    summary = RunSummary.of(suite, journal.header, records)
    usage = Usage.total(
        [record.usage for record in records] + [artifact.usage for artifact in journal.artifacts]
    )
    write_document(folder / RESULTS, results_document(summary, suite, n_missing, usage))
    _write_scores(folder, suite, records)
    write_usage(folder, records, usage)
    return Stored(folder, summary, records, n_missing, usage)


def _write_scores(folder: Path, suite: Suite[Any, Any], records: Sequence[UnitRecord[Any]]) -> None:
    """Write every unit's scores to `scores.jsonl`, an object a line; equal runs give equal
    bytes."""
    rows = (
        {
            "task": record.task,
            "id": record.id,
            "variant": record.variant,
            **({"repeat": record.repeat} if record.repeat > 1 else {}),
            "cluster": record.cluster,
            "state": record.state,
            "scores": suite.scores(record),
            "failure": record.failure,
            "excluded": record.excluded,
        }
        for record in records
    )
    _write(folder / _SCORES, b"".join(msgspec.json.encode(row) + b"\n" for row in rows))


def write_usage(folder: Path, records: Sequence[UnitRecord[Any]], usage: Usage) -> None:
    """Write requests, tokens, time and cost, which differ from run to run, to `usage.json`."""
    document = {
        "requests": usage.requests,
        "read": usage.context,
        "cached": usage.cached,
        "hit_rate": None if usage.hit_rate is None else round(usage.hit_rate, 6),
        "written": usage.reply,
        "seconds": round(math.fsum(record.seconds for record in records), 4),
        "cost": usage.cost,
    }
    write_document(folder / _USAGE, document)


def write_document(path: Path, document: Any) -> None:
    """Write a JSON file into a run's folder, its keys sorted; equal documents give equal bytes."""
    encoded = msgspec.json.encode(document, order="sorted")
    _write(path, msgspec.json.format(encoded, indent=2) + b"\n")


def _write(path: Path, content: bytes) -> None:
    with write_output(path, writing_hint("; the journal holds it all")) as partial:
        partial.write_bytes(content)
