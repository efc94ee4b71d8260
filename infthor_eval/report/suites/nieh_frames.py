"""Frames of questions: the clues with their neighbours, or some of all frames where there are no clues."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import find_set
from infthor_eval.report.presenter import Timelines
from infthor_eval.report.runs import ReportRun, choose_evenly, records_by_unit
from infthor_eval.report.suites.nieh_frame_facts import read_frame_facts
from infthor_eval.report.web.samples import FrameFacts, Timeline, TimelineFrame
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.runs import UnitKey, UnitRecord

__all__ = ["find_timelines"]

Record = UnitRecord[NiehAnswer]
_OVERVIEW = 5  # frames of a trajectory that are shown for a question without clues


def find_timelines(runs: Sequence[ReportRun], data: Path | None, thumbnails: ThumbnailStore) -> Timelines:
    """See `Presenter.timelines`; a set that is missing or has changed since the run has a note.

    Clues of all questions get their pictures before any neighbour does, as there is a limit on the size of all.
    """
    sets = _Sets(runs, data)
    chosen: dict[UnitKey, _FrameChoice] = {}
    for key, records in records_by_unit(runs).items():
        choice = sets.choose_frames(key, next(record for record in records if record))
        if choice is not None:
            chosen[key] = choice
    for choice in chosen.values():
        for index in sorted(choice.clues):
            _picture(choice.frames[index], thumbnails)
    timelines = {key: _timeline(choice, thumbnails) for key, choice in chosen.items()}
    facts = {
        frame.picture: chosen[key].facts[frame.index]
        for key, timeline in timelines.items()
        for frame in timeline.frames
        if frame.picture is not None
    }
    return Timelines(timelines, list(sets.problems), facts)


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


class _Sets:
    """The question sets of the tasks, as far as they are there and unchanged."""

    def __init__(self, runs: Sequence[ReportRun], data: Path | None) -> None:
        self.problems: dict[str, None] = {}  # reasons why frames are missing, each once
        self._sets: dict[str, tuple[NiehSet, Mapping[str, Question]] | None] = {}
        self._facts: dict[Path, Sequence[FrameFacts]] = {}  # by the trajectory's folder
        for run in runs:
            for task in run.tasks:
                if task not in self._sets:
                    self._sets[task] = self._read(run, task, data)

    def choose_frames(self, key: UnitKey, record: Record) -> _FrameChoice | None:
        """Choose frames of a record's question; None if its set is missing or has another question there."""
        question_set = self._sets[key.task]
        if question_set is None:
            return None
        data, questions = question_set
        question = questions.get(key.id)
        if question is None or question.text != record.payload.question:
            return None
        try:
            return _choose_frames(data, question, self._read_facts(data.folder(question.traj_id)))
        except DataError:  # the question was skipped or failed for it, and its record has the reason
            return None

    def _read_facts(self, folder: Path) -> Sequence[FrameFacts]:
        if folder not in self._facts:
            self._facts[folder] = read_frame_facts(folder)
        return self._facts[folder]

    def _read(self, run: ReportRun, task: str, data: Path | None) -> tuple[NiehSet, Mapping[str, Question]] | None:
        folder = data or run.data
        try:
            questions = find_set(str(folder) if folder else None, run.dataset(task).get("bundled"))
        except (UsageError, DataError) as error:
            self.problems[f"{task}: no frames are shown: {error}; give the set's folder with --data"] = None
            return None
        if questions.fingerprint != run.tasks[task].get("data"):
            problem = f"{task}: no frames are shown: {questions.root} has changed since {run.label} was run"
            self.problems[problem] = None
            return None
        return questions, {question.id: question for question in questions.questions}


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
    note = "" if choice.clues else "absence question: no frame is evidence, so five frames are shown, evenly spaced"
    return Timeline(len(choice.frames), tuple(frames), note)


def _picture(frame: FrameRef, thumbnails: ThumbnailStore) -> int | None:
    try:
        return thumbnails.add(str(frame.path), frame.load)
    except DataError:  # an unreadable frame has its place on the timeline, without a picture
        return None
