"""The files that runs wrote in lm-eval's format at their ends, for others."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.exports.gaps import gap_notes
from infthor_eval.exports.lm_eval import FOLDER
from infthor_eval.exports.request import ExportRequest, Written
from infthor_eval.formats.reading import lines_of
from infthor_eval.run import Run
from infthor_eval.storage.files import file_name, write_atomically, writing_hint

_HINT = "run its command again"
_NO_PLACE = (
    "intervals, seconds, tokens, the frames that were shown, thoughts, and steps of episodes"
)


def write(runs: Sequence[Run], request: ExportRequest) -> Written:
    """Copy the files that runs wrote at their ends into `<out>/<model>/`."""
    paths = []
    notes = []
    for run in runs:
        results, samples = _files_of(run)
        folder = request.out / file_name(results.parent.name)
        with wrap_errors(f"{folder}: cannot be written", writing_hint("")):
            folder.mkdir(parents=True, exist_ok=True)
            for path in (results, *samples):
                with write_atomically(folder / path.name) as partial:
                    shutil.copyfile(path, partial)
        paths += [folder / path.name for path in (results, *samples)]
        notes += gap_notes(run)
    return Written(paths, _NO_PLACE, notes)


def _files_of(run: Run) -> tuple[Path, list[Path]]:
    """Return the newest results of a run, and their samples."""
    found = sorted((run.folder / FOLDER).glob("*/results_*.json"), key=lambda path: path.name)
    if not found:
        raise DataError(
            f"{run.folder}: has no {FOLDER}/, which a run writes at its end; run its command "
            "again, or take another format if its replies were imported or scored again"
        )
    results = found[-1]
    stamp = results.stem.removeprefix("results_")
    samples = sorted(results.parent.glob(f"samples_*_{stamp}.jsonl"))
    n_written = sum(1 for path in samples for _ in lines_of(path, _HINT))
    if n_written != len({record.key.once for record in run.records if record.excluded is None}):
        raise DataError(
            f"{results}: is older than the run's journal; run its command again, which writes it"
        )
    return results, samples
