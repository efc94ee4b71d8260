"""The runs below a folder, as far as that can be told without their suites."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, InfthorError, wrap_errors
from infthor_eval.formats.reading import read_bytes
from infthor_eval.rates import Rate
from infthor_eval.runs.records import RunHeader
from infthor_eval.runs.results import RESULTS
from infthor_eval.runs.shards import FOLDER, latest_outcomes, read_header

__all__ = ["BrokenRun", "Results", "StoredRun", "find_runs", "read_results"]

_DEPTH = 4  # folders below the one that is looked through: sets of frames lie in results too


@dataclass(frozen=True)
class StoredRun:
    """A run.

    Attributes:
        folder: its own.
        header: who it is.
        n_done: units that have a record, failed ones among them.
        n_failed: units that the subject failed on.
        n_missing: units that it did not come to; None where it was killed before it could tell.
        headline: the number that each task is known by; none where there are no results yet.
        changed: when it last recorded something, in seconds since 1970.
    """

    folder: Path
    header: RunHeader
    n_done: int
    n_failed: int
    n_missing: int | None
    primary_metrics: Mapping[str, Rate]
    changed: float


@dataclass(frozen=True)
class BrokenRun:
    """The folder of a run that cannot be read, and why."""

    folder: Path
    reason: str


class Results(msgspec.Struct, frozen=True):
    """What can be looked at in `results.json` without the suite.

    Attributes:
        n_missing: units that the run did not come to.
        headline: the number that each task is known by.
    """

    n_missing: int
    primary_metrics: dict[str, Rate] = {}


def find_runs(folder: Path) -> Iterator[StoredRun | BrokenRun]:
    """The runs below a folder, in the order of their places.

    Raises:
        DataError: there is no such folder, or it cannot be looked through.
    """
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder; give the results folder of a run (`--output`, else results)")
    for place in _places(folder, _DEPTH):
        try:
            yield _found(place)
        except InfthorError as error:
            yield BrokenRun(place, str(error))


def read_results(folder: Path) -> Results | None:
    """What a run left in `results.json`; None where there is none yet.

    Raises:
        DataError: it is not what it should be.
    """
    path, mend = folder / RESULTS, "run the same command again"
    if not path.is_file():
        return None
    with wrap_errors(f"{path}: not the results of a run", mend, catch=msgspec.DecodeError):
        return msgspec.json.decode(read_bytes(path, mend), type=Results)


def _places(folder: Path, depth: int) -> Iterator[Path]:
    if (folder / FOLDER).is_dir() or (folder / RESULTS).is_file():
        yield folder
    elif depth:
        with wrap_errors(f"{folder}: cannot be looked through", "make it readable, or give another folder"):
            below = sorted(path for path in folder.iterdir() if path.is_dir() and not path.is_symlink())
        for path in below:
            yield from _places(path, depth - 1)


def _found(folder: Path) -> StoredRun:
    header, failures, results = read_header(folder), latest_outcomes(folder), read_results(folder)
    return StoredRun(
        folder=folder,
        header=header,
        n_done=len(failures),
        n_failed=sum(failures.values()),
        n_missing=results.n_missing if results else None,
        primary_metrics=results.primary_metrics if results else {},
        changed=max(path.stat().st_mtime for path in (folder / FOLDER).iterdir()),
    )
