"""The requests of questions for the page: their texts, and which frames are where."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path

from infthor_eval.errors import DataError, InfthorError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.video import Video
from infthor_eval.nieh.contexts import ContextPart
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.rebuilt_requests import RebuiltRequest, RequestRebuilder
from infthor_eval.report.suites.nieh_sets import RunSets
from infthor_eval.report.web.samples import Prompt, PromptFrames
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[NiehAnswer]
_Positions = dict[FrameRef, list[int]]  # of each picture in the trajectory; some are there twice
_OF_BASELINES = "a baseline is not sent it: it answers from the questions alone"


def find_prompts(run: Run, data: Path | None) -> Mapping[UnitKey, Prompt]:
    """See `Presenter.prompts`."""
    sets = RunSets([run], data)
    rebuilders: dict[str, RequestRebuilder | str] = {
        task: _rebuilder(run, task, sets) for task in run.tasks
    }
    note = _OF_BASELINES if "baseline" in run.header.config.model else ""
    ablation = run.header.config.frames
    kept: dict[Prompt, Prompt] = {}
    prompts = {}
    for record in run.records:
        prompt = _prompt(
            rebuilders[record.task], record, sets.find_set(record.task), ablation, note
        )
        prompts[record.key] = kept.setdefault(prompt, prompt)
    return prompts


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


def _prompt(
    rebuilder: RequestRebuilder | str,
    record: Record,
    data: NiehSet | None,
    ablation: str,
    note: str,
) -> Prompt:
    if data is None or isinstance(rebuilder, str):
        return Prompt(problem=str(rebuilder))
    try:
        request = rebuilder.rebuild(record)
        positions: _Positions = {}
        for position, frame in enumerate(data.frames(request.traj_id)):
            positions.setdefault(frame, []).append(position)
    except InfthorError as error:
        return Prompt(problem=str(error))
    before = request.text.removesuffix(record.payload.question)
    return Prompt(
        (*_parts(request, positions, ablation), before),
        _stretches(sorted(set(request.positions))),
        note=note,
    )


def _parts(
    request: RebuiltRequest, positions: _Positions, ablation: str
) -> Iterator[str | PromptFrames]:
    """Yield texts and frames; neighbours of one kind are one part."""
    for kind, group in groupby(request.context, type):
        parts = list(group)
        if kind is str:
            yield "".join(part for part in parts if isinstance(part, str))
        elif kind is FrameRef:
            yield _frames(
                "frames",
                [part for part in parts if isinstance(part, FrameRef)],
                positions,
                ablation,
            )
        else:
            yield from (_film(part, positions, ablation) for part in parts)


def _film(part: ContextPart, positions: _Positions, ablation: str) -> PromptFrames:
    assert isinstance(part, Video)
    return _frames(f"video of {part.fps:g} frames per second", part.frames, positions, ablation)


def _frames(
    what: str, frames: Sequence[FrameRef], positions: _Positions, ablation: str
) -> PromptFrames:
    """Return frames by their positions; those of other trajectories, blank or decoded have none."""
    own: list[int] = []
    for frame in frames:
        places = positions.get(frame, ())
        # Of equal pictures the next one: requests are in time order.
        later = (place for place in places if not own or place > own[-1])
        own += [next(later, places[0])] if places else []
    is_own = len(own) == len(frames)
    description = what if ablation == SHOWN else f"{what} ({ablation})"
    return PromptFrames(description, _stretches(own) if is_own else (), len(frames))


def _stretches(positions: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Return first and last of each stretch of ascending neighbours."""
    stretches: list[tuple[int, int]] = []
    for position in positions:
        if stretches and position == stretches[-1][1] + 1:
            stretches[-1] = stretches[-1][0], position
        else:
            stretches.append((position, position))
    return tuple(stretches)
