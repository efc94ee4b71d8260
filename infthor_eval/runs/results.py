"""The files that a run leaves beside its journal: what it found, and what it took."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import naming
from infthor_eval.formats.files import written_atomically
from infthor_eval.runs.records import UnitRecord
from infthor_eval.runs.suite import RunSummary
from infthor_eval.runs.usage import Usage

__all__ = ["write_results", "write_took"]

_RESULTS = "results.json"
_TOOK = "took.json"


def write_results(folder: Path, found: RunSummary, n_missing: int, usage: Usage) -> None:
    """Write what a run found; equal runs give equal bytes.

    Args:
        folder: the run's.
        found: who it was, and what it found.
        n_missing: how many units were not come to.
        usage: what all its requests took.

    Raises:
        DataError: it cannot be written.
    """
    header = found.header
    document = {
        "suite": header.suite,
        "name": header.name,
        "identity": header.identity,
        "n_missing": n_missing,
        "summary": found.summary,
        # Not what was cached: that differs between a run and the same run resumed, or shared out.
        "usage": {name: getattr(usage, name) for name in ("requests", "context", "reply", "cost")},
    }
    _write(folder / _RESULTS, document)


def write_took(folder: Path, records: Sequence[UnitRecord[Any]], usage: Usage) -> None:
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
    with (
        naming(f"{path}: cannot be written", "make room, the journal holds it all"),
        written_atomically(path) as partial,
    ):
        encoded = msgspec.json.encode(document, order="sorted")
        partial.write_bytes(msgspec.json.format(encoded, indent=2) + b"\n")
