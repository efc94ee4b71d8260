"""Frames of questions: the clues with their neighbours, or some of all, and what logs say."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import LoggedPose, Step, read_steps
from infthor_eval.report.presenter import Timelines
from infthor_eval.report.runs import ReportRun, choose_evenly, records_by_unit
from infthor_eval.report.suites.nieh_sets import RunSets
from infthor_eval.report.web.samples import FrameFacts, Timeline, TimelineFrame
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.runs import UnitKey

__all__ = ["find_timelines"]

_OVERVIEW = 5  # frames of a trajectory that are shown for a question without clues


def find_timelines(
    runs: Sequence[ReportRun], data: Path | None, thumbnails: ThumbnailStore
) -> Timelines:
    """See `Presenter.timelines`; a set that is missing or has changed since the run has a note.

    Clues of all questions get their pictures before any neighbour does, as there is a limit on the
    size of all.
    """
    sets = RunSets(runs, data)
    logs = _TrajectoryFacts()
    chosen: dict[UnitKey, _FrameChoice] = {}
    for key, records in records_by_unit(runs).items():
        question = sets.find_question(key, next(record for record in records if record))
        opened = sets.find_set(key.task)
        if opened is None or question is None:
            continue
        try:
            facts_of_frames = logs.read(opened.folder(question.traj_id))
            chosen[key] = _choose_frames(opened, question, facts_of_frames)
        # The question was skipped or failed for it, and its record has the reason.
        except DataError:
            continue
    thumbnails.expect(
        len(
            {choice.frames[at] for choice in chosen.values() for at in choice.clues | choice.others}
        )
    )
    for choice in chosen.values():
        for index in sorted(choice.clues):
            _picture(choice.frames[index], thumbnails)
    notes = [f"{task}: no frames are shown: {problem}" for task, problem in sets.problems.items()]
    timelines = {key: _timeline(choice, thumbnails) for key, choice in chosen.items()}
    facts = {
        frame.picture: chosen[key].facts[frame.index]
        for key, timeline in timelines.items()
        for frame in timeline.frames
        if frame.picture is not None
    }
    return Timelines(timelines, notes, facts)


@dataclass(frozen=True)
class _FrameChoice:
    """Frames to show for a question.

    Attributes:
        frames: all frames of its trajectory.
        facts: what the set's log says of each of them.
        clues: indices of the clues.
        others: indices of further frames.
    """

    frames: Sequence[FrameRef]
    facts: Sequence[FrameFacts]
    clues: frozenset[int]
    others: frozenset[int]


class _TrajectoryFacts:
    """What the logs of trajectories say of their frames, each log read once."""

    def __init__(self) -> None:
        self._facts: dict[Path, Sequence[FrameFacts]] = {}  # by the trajectory's folder

    def read(self, folder: Path) -> Sequence[FrameFacts]:
        if folder not in self._facts:
            self._facts[folder] = _read_frame_facts(folder)
        return self._facts[folder]


def _choose_frames(data: NiehSet, question: Question, facts: Sequence[FrameFacts]) -> _FrameChoice:
    frames = data.frames(question.traj_id)
    # The clues of an absence are a sample of the trajectory, and no evidence.
    clue_frames = set() if question.absence else set(data.clue_frames(question))
    clues = frozenset(index for index, frame in enumerate(frames) if frame in clue_frames)
    last = len(frames) - 1
    others = {near for index in clues for near in (index - 1, index + 1) if 0 <= near <= last}
    if not clues:
        others = set(choose_evenly(range(len(frames)), _OVERVIEW))
    return _FrameChoice(frames, facts, clues, frozenset(others - clues))


def _timeline(choice: _FrameChoice, thumbnails: ThumbnailStore) -> Timeline:
    frames = (
        TimelineFrame(index, _picture(choice.frames[index], thumbnails), index in choice.clues)
        for index in sorted(choice.clues | choice.others)
    )
    note = (
        ""
        if choice.clues
        else "absence question: no frame is evidence, so five frames are shown, evenly spaced"
    )
    return Timeline(len(choice.frames), tuple(frames), note)


def _picture(frame: FrameRef, thumbnails: ThumbnailStore) -> int | None:
    try:
        return thumbnails.add(str(frame.path.with_name(frame.name)), frame.load)
    except DataError:  # an unreadable frame has its place on the timeline, without a picture
        return None


def _read_frame_facts(folder: Path) -> Sequence[FrameFacts]:
    """Return what the log of a trajectory's folder says of each frame, in time order.

    Raises:
        DataError: the log cannot be read.
    """
    return [_facts(step) for step in sorted(read_steps(folder), key=lambda step: step.img_idx)]


def _facts(step: Step) -> FrameFacts:
    refusal = "" if step.success else step.error or "refused by the simulator"
    return FrameFacts(
        step=step.step,
        action=step.action or "",
        error=refusal,
        objects=tuple(step.object_log.visible),
        held=tuple(step.object_log.inven_obj),
        pose="" if step.pose is None else _pose(step.pose),
    )


def _pose(pose: LoggedPose) -> str:
    return (
        f"x {pose.x:.2f} m, z {pose.z:.2f} m; turned {pose.rotation:.0f}°, camera "
        f"{pose.horizon:.0f}° down"
    )
