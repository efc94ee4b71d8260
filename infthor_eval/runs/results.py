"""The files that a run writes beside its journal: results, scores and usage."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.runs.journals.records import UnitRecord
from infthor_eval.runs.suite import RunSummary, Suite
from infthor_eval.runs.usage import Usage
from infthor_eval.storage.files import write_atomically, writing_hint

RESULTS = "results.json"
_SCORES = "scores.jsonl"
_USAGE = "usage.json"


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


def write_run_files(
    folder: Path,
    run: RunSummary,
    suite: Suite[Any, Any],
    records: Sequence[UnitRecord[Any]],
    n_missing: int,
    usage: Usage,
) -> None:
    """Write results, scores and usage of a run; see the functions below for each."""
    write_results(folder, results_document(run, suite, n_missing, usage))
    write_scores(folder, suite, records)
    write_usage(folder, records, usage)


def write_results(folder: Path, document: dict[str, Any]) -> None:
    """Write `results.json` (`results_document`) into a run's folder; equal runs give equal
    bytes."""
    write_document(folder / RESULTS, document)


def write_scores(folder: Path, suite: Suite[Any, Any], records: Sequence[UnitRecord[Any]]) -> None:
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
    with _atomic_file(folder / _SCORES) as partial:
        partial.write_bytes(b"".join(msgspec.json.encode(row) + b"\n" for row in rows))


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
    with _atomic_file(path) as partial:
        encoded = msgspec.json.encode(document, order="sorted")
        partial.write_bytes(msgspec.json.format(encoded, indent=2) + b"\n")


@contextmanager
def _atomic_file(path: Path) -> Iterator[Path]:
    with (
        wrap_errors(f"{path}: cannot be written", writing_hint("; the journal holds it all")),
        write_atomically(path) as partial,
    ):
        yield partial
