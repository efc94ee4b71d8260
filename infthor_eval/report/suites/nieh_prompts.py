"""The pictures of the requests of questions, which a set has, and no journal."""

from pathlib import Path

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.rebuilt_requests import RequestRebuilder
from infthor_eval.report.suites.nieh_sets import RunSets
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord

Record = UnitRecord[NiehAnswer]


class RequestFrames:
    """Finds the frames of a run's requests; see `Presenter.request_frames`."""

    def __init__(self, run: Run, data: Path | None) -> None:
        sets = RunSets([run], data)
        self._rebuilders = {task: _rebuilder(run, task, sets) for task in run.tasks}

    def __call__(self, record: Record) -> list[FrameRef]:
        """Return the frames of a record's request, those of films too.

        Raises:
            DataError: the request cannot be made again, or not exactly.
        """
        rebuilder = self._rebuilders[record.task]
        if isinstance(rebuilder, str):
            raise DataError(rebuilder)
        parts = as_images(rebuilder.rebuild(record).context)
        return [part for part in parts if isinstance(part, FrameRef)]


def _rebuilder(run: Run, task: str, sets: RunSets) -> RequestRebuilder | str:
    """Return what makes the requests of a task again, or why nothing can."""
    opened = sets.find_set(task)
    if opened is None:
        return sets.problems[task]
    try:
        return RequestRebuilder(run.header, task, opened)
    except InfthorError as error:
        return str(error)
