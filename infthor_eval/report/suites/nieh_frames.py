"""Frames of questions: the clues with their neighbours, or some of all, and what logs say; and the
frames of requests.

Of twins: the clues, and frames that differ between both worlds; the same ones of either. All are
read from the sets, as far as these are there and unchanged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import chain
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError, InfthorError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import LoggedPose, Step, read_steps
from infthor_eval.formats.twins import TwinPair
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.rebuilt_requests import RequestRebuilder
from infthor_eval.nieh.samples import find_set
from infthor_eval.report.presenter import Timelines
from infthor_eval.report.runs import choose_evenly, records_by_unit
from infthor_eval.report.web.samples import FrameFacts, Numbered, Timeline, TimelineFrame
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

Record = UnitRecord[NiehAnswer]
_OVERVIEW = 5  # frames of a trajectory that are shown for a question without clues
_DIFFERING = 6  # frames beside the clues that are shown of those that differ from the twin's


def find_timelines(runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore) -> Timelines:
    """See `PlainPresenter.timelines`; a set that is missing or has changed since has a note.

    Clues of all questions get their pictures before any neighbour does, as there is a limit on the
    size of all.
    """
    sets = RunSets(runs, data)
    read_facts = cache(_read_frame_facts)  # each log once
    chosen: dict[UnitKey, _FrameChoice] = {}
    for key, records in records_by_unit(runs).items():
        question = sets.find_question(key, next(record for record in records if record))
        opened = sets.find_set(key.task)
        if opened is None or question is None:
            continue
        try:
            facts_of_frames = read_facts(opened.folder(question.traj_id))
            choice = _choose_frames(opened, question, facts_of_frames)
            chosen[key] = replace(choice, recalled=_recalled(records) - choice.shown)
        # The question was skipped or failed for it, and its record has the reason.
        except DataError:
            continue
    choices = chosen.values()
    wanted = chain(
        (choice.frames[at] for choice in choices for at in sorted(choice.clues)),
        (choice.frames[at] for choice in choices for at in sorted(choice.others)),
        (choice.frames[at] for choice in choices for at in sorted(choice.recalled)),
    )
    thumbnails.add_all({str(frame.path): frame.load for frame in wanted})
    notes = [f"{task}: no frames are shown: {problem}" for task, problem in sets.problems.items()]
    facts = Numbered[FrameFacts]()
    timelines = {key: _timeline(choice, thumbnails, facts) for key, choice in chosen.items()}
    return Timelines(timelines, notes, facts.values)


@dataclass(frozen=True)
class _FrameChoice:
    """Frames to show for a question.

    Attributes:
        frames: all frames of its trajectory.
        facts: what the set's log says of each of them.
        clues: indices of the clues.
        others: indices of further frames.
        recalled: indices of frames beyond these that a memory recalled.
        changed: types of what is in view and differs from the twin's frame, by the frame's index,
            for all frames whose pictures differ.
    """

    frames: Sequence[FrameRef]
    facts: Sequence[FrameFacts]
    clues: frozenset[int]
    others: frozenset[int]
    changed: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    recalled: frozenset[int] = frozenset()

    @property
    def shown(self) -> frozenset[int]:
        """Indices of the clues and the further frames."""
        return self.clues | self.others


def _choose_frames(data: NiehSet, question: Question, facts: Sequence[FrameFacts]) -> _FrameChoice:
    frames = data.frames_until(question)
    # The clues of an absence are a sample of the trajectory, and no evidence.
    clues = frozenset(data.clue_positions(question) if question.has_evidence else ())
    pair = data.twins.get(question.traj_id) if question.pair else None
    if pair is not None:
        changed = _changed(pair, question.traj_id, len(frames))
        differing = choose_evenly(sorted(changed.keys() - clues), _DIFFERING)
        return _FrameChoice(frames, facts, clues, frozenset(differing), changed)
    last = len(frames) - 1
    others = {near for index in clues for near in (index - 1, index + 1) if 0 <= near <= last}
    if not clues:
        others = set(choose_evenly(range(len(frames)), _OVERVIEW))
    return _FrameChoice(frames, facts, clues, frozenset(others - clues))


def _recalled(records: Sequence[UnitRecord[NiehAnswer] | None]) -> frozenset[int]:
    """Return the indices of the frames that the runs' memories recalled for a question."""
    recalls = [
        record.payload.recall
        for record in records
        if record is not None and record.payload.recall is not None
    ]
    return frozenset(
        part for recall in recalls for part in recall.recalled if isinstance(part, int)
    )


def _changed(pair: TwinPair, traj_id: str, n_frames: int) -> dict[int, tuple[str, ...]]:
    """Return the types of what differs in one world's first frames, by the indices of those."""
    is_first = traj_id == pair.traj_ids[0]
    changed = {}
    for index, frame in enumerate(pair.frames[:n_frames]):
        if not frame.same:
            names = (name if is_first else pair.ids.get(name, name) for name in frame.changed)
            changed[index] = tuple(sorted({name.partition("|")[0] for name in names}))
    return changed


def _timeline(
    choice: _FrameChoice, thumbnails: ThumbnailStore, facts: Numbered[FrameFacts]
) -> Timeline:
    def frame(index: int) -> TimelineFrame:
        known = msgspec.structs.replace(choice.facts[index], changed=choice.changed.get(index, ()))
        return TimelineFrame(
            index,
            thumbnails.number(str(choice.frames[index].path)),
            index in choice.clues,
            index in choice.changed,
            facts.number(known),
        )

    note = (
        ""
        if choice.clues
        else "absence question: no frame is evidence, so five frames are shown, evenly spaced"
    )
    frames = tuple(map(frame, sorted(choice.shown)))
    recalled = tuple(map(frame, sorted(choice.recalled)))
    return Timeline(len(choice.frames), frames, note, recalled)


def _read_frame_facts(folder: SetPath) -> Sequence[FrameFacts]:
    """Return what the log of a trajectory's folder says of each frame, in time order."""
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


class RunSets:
    """The sets of the tasks of some runs.

    Attributes:
        problems: reason why a task has no set, by its name.
    """

    def __init__(self, runs: Sequence[Run], data: Path | None) -> None:
        """Open the sets; `data` is the folder of all, None for the one that each run names."""
        self.problems: dict[str, str] = {}
        self._sets: dict[str, tuple[NiehSet, Mapping[str, Question]]] = {}
        for run in runs:
            for task in run.tasks:
                if task not in self._sets and task not in self.problems:
                    self._open(run, task, data)

    def find_set(self, task: str) -> NiehSet | None:
        """Return the set of a task; None if it is missing or has changed."""
        return self._sets[task][0] if task in self._sets else None

    def find_question(self, key: UnitKey, record: Record) -> Question | None:
        """Return the question of a record; None if its set is missing or has another one there."""
        question = self._sets[key.task][1].get(key.id) if key.task in self._sets else None
        return (
            question if question is not None and question.text == record.payload.question else None
        )

    def _open(self, run: Run, task: str, data: Path | None) -> None:
        folder = data or run.data
        options = run.stored_command.options if run.stored_command else {}
        try:
            opened = find_set(
                str(folder) if folder else None,
                run.tasks[task].dataset_kwargs.get("bundled"),
                options.get("trajectories"),
            )
        except (UsageError, DataError) as error:
            self.problems[task] = f"{error}; give the set's folder with --data"
            return
        if opened.fingerprint != run.tasks[task].data:
            self.problems[task] = f"{opened.root} has changed since {run.label} was run"
            return
        self._sets[task] = opened, {question.id: question for question in opened.questions}


class RequestFrames:
    """Finds the frames of a run's requests; see `PlainPresenter.request_frames`."""

    def __init__(self, run: Run, data: Path | None) -> None:
        sets = RunSets([run], data)
        self._rebuilders = {task: _rebuilder(run, task, sets) for task in run.tasks}

    def __call__(self, record: Record) -> list[FrameRef]:
        """Return the frames of a record's request, those of films too."""
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
