"""The files that a run leaves beside its journal: what it found, and what it took."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.files import write_atomically
from infthor_eval.runs.records import UnitRecord
from infthor_eval.runs.suite import RunSummary, Suite
from infthor_eval.runs.usage import Usage

__all__ = ["RESULTS", "results_document", "write_results", "write_scores", "write_usage"]

RESULTS = "results.json"
_SCORES = "scores.jsonl"
_TOOK = "usage.json"


def results_document(found: RunSummary, suite: Suite[Any, Any], n_missing: int | None, usage: Usage) -> dict[str, Any]:
    """What a run found, as it is written; docs/formats.md describes it.

    Args:
        found: who it was, and what it found.
        suite: that knows what the run is known by.
        n_missing: how many units were not come to; None where that is not known.
        usage: what all its requests took.
    """
    header = found.header
    return {
        "suite": header.suite,
        "name": header.name,
        "config": header.config,
        "n_missing": n_missing,
        "primary_metrics": suite.primary_metrics(found.summary),
        "summary": found.summary,
        # Not what was cached: that differs between a run and the same run resumed, or shared out.
        "usage": {name: getattr(usage, name) for name in ("requests", "context", "reply", "cost")},
    }


def write_results(folder: Path, document: dict[str, Any]) -> None:
    """Write what a run found; equal runs give equal bytes.

    Args:
        folder: the run's.
        document: see `results_document`.

    Raises:
        DataError: it cannot be written.
    """
    _write(folder / RESULTS, document)


def write_scores(folder: Path, suite: Suite[Any, Any], records: Sequence[UnitRecord[Any]]) -> None:
    """Write the scores of every unit, a JSON object a line; equal runs give equal bytes.

    Args:
        folder: the run's.
        suite: that scores.
        records: of the run's units.

    Raises:
        DataError: it cannot be written.
    """
    rows = (
        {
            "task": record.task,
            "id": record.id,
            "variant": record.variant,
            "cluster": record.cluster,
            "scores": suite.scores(record),
            "failure": record.failure,
            "excluded": record.excluded,
        }
        for record in records
    )
    with _written(folder / _SCORES) as partial:
        partial.write_bytes(b"".join(msgspec.json.encode(row) + b"\n" for row in rows))


def write_usage(folder: Path, records: Sequence[UnitRecord[Any]], usage: Usage) -> None:
    """Write what a run took, which differs from run to run.

    Args:
        folder: the run's.
        records: of its units.
        usage: what all its requests took.

    Raises:
        DataError: it cannot be written.
    """
    document = {
        "requests": usage.requests,
        "read": usage.context,
        "cached": usage.cached,
        "hit_rate": None if usage.hit_rate is None else round(usage.hit_rate, 6),
        "written": usage.reply,
        "seconds": round(math.fsum(record.seconds for record in records), 4),
        "cost": usage.cost,
    }
    _write(folder / _TOOK, document)


def _write(path: Path, document: dict[str, Any]) -> None:
    with _written(path) as partial:
        encoded = msgspec.json.encode(document, order="sorted")
        partial.write_bytes(msgspec.json.format(encoded, indent=2) + b"\n")


@contextmanager
def _written(path: Path) -> Iterator[Path]:
    with (
        wrap_errors(f"{path}: cannot be written", "make room, the journal holds it all"),
        write_atomically(path) as partial,
    ):
        yield partial
