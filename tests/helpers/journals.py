"""Journals: those of runs that nobody ran, and what is in those of runs."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from infthor_eval.runs import (
    RecordTypes,
    RunHeader,
    StoredRequest,
    UnitRecord,
    read_header,
    read_run,
)
from infthor_eval.runs.journals.journal import Journal
from infthor_eval.suites import find_suite

__all__ = [
    "RecordedRun",
    "read_outcome",
    "read_records",
    "spoil_config",
    "write_journal",
    "write_run",
]


class RecordedRun(Protocol):
    """A run of episodes as reports read it."""

    label: str
    header: RunHeader
    records: Sequence[UnitRecord[Any]]


def write_journal(
    folder: Path,
    header: RunHeader,
    records: Sequence[UnitRecord[Any]],
    types: RecordTypes[Any],
    requests: Mapping[str, StoredRequest] = MappingProxyType({}),
) -> Path:
    """Write the journal of a run as the driver does; returns the run's folder."""
    with Journal(folder, header, types) as journal:
        for name, request in requests.items():
            journal.cache_artifact(name, request)
        for record in records:
            journal.append(record)
    return folder


def spoil_config(folder: Path) -> None:
    """Leave nothing of what a run's journal says of its tasks, as another version's may."""
    path = folder / "journal" / "worker-0.jsonl"
    header, *lines = path.read_bytes().splitlines(keepends=True)
    content = json.loads(header)
    content["config"]["tasks"] = {name: {} for name in content["config"]["tasks"]}
    path.write_bytes(json.dumps(content).encode() + b"\n" + b"".join(lines))


def write_run(run: RecordedRun, output: Path, name: str | None = None) -> Path:
    """Write the journal of a run below its label; returns the run's folder, `name` or one of the
    suite."""
    folder = output / run.label / (name or f"{run.header.suite}-0123")
    return write_journal(folder, run.header, run.records, find_suite(run.header.suite).records)


def count_records(output: Path, kind: str = "unit") -> int:
    """The records of a kind that the journals below a folder have so far."""
    tag = f'"type":"{kind}"'.encode()
    return sum(path.read_bytes().count(tag) for path in output.rglob("worker-*.jsonl"))


def read_records(output: Path) -> list[UnitRecord[Any]]:
    """The records of the one run below a folder."""
    (journal,) = output.rglob("journal")
    suite = find_suite(read_header(journal.parent).suite)
    return read_run(journal.parent, suite.records)[1]


def read_outcome(output: Path) -> tuple[list[UnitRecord[Any]], dict[str, Any]]:
    """The records of the one run below a folder, and its results."""
    (results,) = output.rglob("results.json")
    return read_records(output), json.loads(results.read_text())
