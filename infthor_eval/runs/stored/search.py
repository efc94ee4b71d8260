"""Finding the runs below a folder, without their suites."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, InfthorError, wrap_errors
from infthor_eval.formats.reading import NOT_JSON, read_bytes
from infthor_eval.quantities import AmountSum, CountSum
from infthor_eval.rates import Rate
from infthor_eval.runs.completeness import count_missing
from infthor_eval.runs.journals.records import RunHeader
from infthor_eval.runs.journals.shards import FOLDER, Tell, read_header, read_states
from infthor_eval.runs.results import RESULTS
from infthor_eval.runs.usage import NOTHING, Usage

_DEPTH = 4  # levels of folders that are searched: results may hold sets with thousands of frames


@dataclass(frozen=True)
class StoredRun:
    """A run on disk.

    Attributes:
        n_answered: number of units with a result.
        n_failed: number of units that failed.
        n_not_asked: number of units that were not attempted, or that a cap left out; None if
            neither header nor results tell.
        primary_metrics: primary metric of each task; empty if there are no results yet.
        usage: requests, tokens and cost; of the results, so nothing before there are any.
        changed: time of the last change to the journal, in seconds since 1970.
    """

    folder: Path
    header: RunHeader
    n_answered: int
    n_failed: int
    n_not_asked: int | None
    primary_metrics: Mapping[str, Rate]
    usage: Usage
    changed: float


@dataclass(frozen=True)
class BrokenRun:
    """The folder of a run that cannot be read, and why."""

    folder: Path
    reason: str


class _UsageOfAll(Usage, frozen=True, omit_defaults=True):
    """Usage of all units together, which may be beyond what one unit's may be."""

    requests: CountSum = 0
    context: CountSum = 0
    cached: CountSum = 0
    reply: CountSum = 0
    cost: AmountSum | None = None


class Results(msgspec.Struct, frozen=True):
    """The fields of `results.json` that need no suite."""

    n_missing: int
    primary_metrics: dict[str, Rate] = {}
    usage: _UsageOfAll = _UsageOfAll()


def find_runs(folder: Path, tell: Tell | None = None) -> Iterator[StoredRun | BrokenRun]:
    """Yield the runs below a folder, in the order of their paths.

    Args:
        folder: the folder.
        tell: told of bad lines of journals, see `read_run`.

    Raises:
        DataError: there is no such folder, or it cannot be searched.
    """
    if not folder.is_dir():
        raise DataError(
            f"{folder}: no such folder; give the results folder of a run (`--out`, else results)"
        )
    for run in run_folders(folder):
        try:
            yield _read_run(run, tell)
        except InfthorError as error:
            yield BrokenRun(run, str(error))


def read_results(folder: Path) -> Results | None:
    """Read `results.json` of a run; None if there is none yet.

    Raises:
        DataError: the file is not valid.
    """
    path = folder / RESULTS
    hint = "run the same command again"
    if not path.is_file():
        return None
    with wrap_errors(f"{path}: not the results of a run", hint, catch=NOT_JSON):
        return msgspec.json.decode(read_bytes(path, hint), type=Results)


def run_folders(folder: Path, depth: int = _DEPTH) -> Iterator[Path]:
    """Yield the folders of runs at and below a folder, at most `depth` levels deep.

    Raises:
        DataError: a folder cannot be searched.
    """
    if (folder / FOLDER).is_dir() or (folder / RESULTS).is_file():
        yield folder
    elif depth:
        with wrap_errors(
            f"{folder}: cannot be searched", "make it readable, or give another folder"
        ):
            below = sorted(
                path for path in folder.iterdir() if path.is_dir() and not path.is_symlink()
            )
        for path in below:
            yield from run_folders(path, depth - 1)


def _read_run(folder: Path, tell: Tell | None) -> StoredRun:
    header = read_header(folder)
    states = Counter(read_states(folder, tell).values())
    results = read_results(folder)
    n_missing = count_missing(header, states.total())
    if n_missing is None and results is not None:
        n_missing = results.n_missing
    return StoredRun(
        folder=folder,
        header=header,
        n_answered=states["answered"],
        n_failed=states["failed"],
        n_not_asked=None if n_missing is None else n_missing + states["not asked"],
        primary_metrics=results.primary_metrics if results else {},
        usage=results.usage if results else NOTHING,
        changed=max(path.stat().st_mtime for path in (folder / FOLDER).iterdir()),
    )
