"""Finding the runs below a folder, without their suites."""

from collections.abc import Iterator
from pathlib import Path

import msgspec

from infthor_eval.errors import wrap_errors
from infthor_eval.formats.reading import NOT_JSON, read_bytes
from infthor_eval.quantities import AmountSum, CountSum
from infthor_eval.rates import Rate
from infthor_eval.runs.journals.shards import FOLDER
from infthor_eval.runs.results import RESULTS
from infthor_eval.runs.usage import Usage

_DEPTH = 4  # levels of folders that are searched: results may hold sets with thousands of frames


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


def read_results(folder: Path) -> Results | None:
    """Read `results.json` of a run; None if there is none yet."""
    path = folder / RESULTS
    hint = "run the same command again"
    if not path.is_file():
        return None
    with wrap_errors(f"{path}: not the results of a run", hint, catch=NOT_JSON):
        return msgspec.json.decode(read_bytes(path, hint), type=Results)


def run_folders(folder: Path, depth: int = _DEPTH) -> Iterator[Path]:
    """Yield the folders of runs at and below a folder, at most `depth` levels deep."""
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
