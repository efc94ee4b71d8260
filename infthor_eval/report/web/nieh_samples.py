"""Questions as samples: replies and scores of all runs, and the clue frames with their neighbours."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, clue_column
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import find_set
from infthor_eval.report.web.runs import ReportRun, merged
from infthor_eval.report.web.samples import Frame, Result, Sample, Timeline, outcome
from infthor_eval.report.web.thumbnails import Thumbnails
from infthor_eval.runs import UnitKey, UnitRecord

__all__ = ["nieh_samples"]

Record = UnitRecord[NiehAnswer]
_MAIN = "strict"  # the scorer that says right or wrong
_GLANCES = 5  # frames of a trajectory that are shown of a question without clues


def nieh_samples(
    runs: Sequence[ReportRun], data: Path | None, thumbnails: Thumbnails
) -> tuple[list[Sample], list[str]]:
    """All questions that a run has a record of, in the order of their keys.

    Args:
        runs: of NIEH.
        data: folder of the set of tasks that do not bring their own; None asks each run where its set was.
        thumbnails: takes the frames: clues before their neighbours.

    Returns:
        The samples, and what must be said: a set that is not there, or is another now.
    """
    records = merged(runs)
    sets = _Sets(runs, data)
    asked = {key: sets.asked(key, next(it for it in found if it)) for key, found in records.items()}
    wanted = {key: _wanted(found.data, found.question) for key, found in asked.items() if found}
    timelines = dict(_timelines(wanted, thumbnails))
    samples = [_sample(key, records[key], timelines.get(key)) for key in asked]
    return samples, sets.problems


@dataclass(frozen=True)
class _Asked:
    """A question, and the set that it is of."""

    data: NiehSet
    question: Question


class _Sets:
    """The sets of the tasks, as far as they are there and the same as they were."""

    def __init__(self, runs: Sequence[ReportRun], data: Path | None) -> None:
        self.problems: list[str] = []
        self._questions: dict[str, dict[str, _Asked]] = {}
        for run in runs:
            for task in run.tasks:
                if task not in self._questions:
                    self._questions[task] = self._read(run, task, data)

    def asked(self, key: UnitKey, record: Record) -> _Asked | None:
        """The question of a record, if the set has it with these very words."""
        found = self._questions[key.task].get(key.id)
        return found if found is not None and found.question.text == record.payload.question else None

    def _read(self, run: ReportRun, task: str, data: Path | None) -> dict[str, _Asked]:
        folder = data or run.data
        settings = run.dataset(task)
        try:
            found = find_set(str(folder) if folder else None, settings.get("bundled"))
        except (UsageError, DataError) as error:
            self._say(f"{task}: no frames are shown: {error}; give the set's folder with --data")
            return {}
        if found.fingerprint != run.tasks[task].get("data"):
            self._say(f"{task}: no frames are shown: {found.root} is not what it was when {run.label} was run")
            return {}
        return {question.id: _Asked(found, question) for question in found.questions}

    def _say(self, problem: str) -> None:
        if problem not in self.problems:
            self.problems.append(problem)


@dataclass(frozen=True)
class _Wanted:
    """Frames of a question that are to be shown."""

    frames: Sequence[FrameRef]
    clues: frozenset[int]
    beside: frozenset[int]


def _wanted(data: NiehSet, question: Question) -> _Wanted | None:
    try:
        frames = data.frames(question.traj_id)
        clue_frames = set(data.clue_frames(question))
    except DataError:  # the record of the question says so: it was skipped, or failed
        return None
    clues = frozenset(at for at, frame in enumerate(frames) if frame in clue_frames)
    last = len(frames) - 1
    beside = {near for at in clues for near in (at - 1, at + 1) if 0 <= near <= last}
    glances = {round(number * last / (_GLANCES - 1)) for number in range(_GLANCES)} if not clues else set()
    return _Wanted(frames, clues, frozenset((beside | glances) - clues))


def _timelines(wanted: Mapping[UnitKey, _Wanted | None], thumbnails: Thumbnails) -> Iterator[tuple[UnitKey, Timeline]]:
    """Clues of all questions have their pictures before any neighbour has."""
    there = {key: found for key, found in wanted.items() if found is not None}
    for found in there.values():
        for at in sorted(found.clues):
            _picture(found.frames[at], thumbnails)
    for key, found in there.items():
        frames = (
            Frame(at, _picture(found.frames[at], thumbnails), at in found.clues)
            for at in sorted(found.clues | found.beside)
        )
        note = "" if found.clues else "no frame proves an absence: these are five of all, evenly"
        yield key, Timeline(len(found.frames), tuple(frames), note)


def _picture(frame: FrameRef, thumbnails: Thumbnails) -> int | None:
    try:
        return thumbnails.add(str(frame.path), frame.load)
    except DataError:  # a frame that cannot be read is a place without a picture
        return None


def _sample(key: UnitKey, records: Sequence[Record | None], timeline: Timeline | None) -> Sample:
    first = next(record for record in records if record is not None)
    payload = first.payload
    return Sample(
        suite="nieh",
        task=key.task,
        id=key.id,
        variant=key.variant,
        cluster=first.cluster,
        kind=payload.question_type or "untyped",
        clues=clue_column(payload.n_clues),
        title=payload.question,
        wanted=", ".join(map(str, payload.answers)),
        results=tuple(_result(record) if record is not None else None for record in records),
        timeline=timeline,
    )


def _result(record: Record) -> Result:
    scores = record.payload.scores
    tokens = record.tokens
    return Result(
        outcome=outcome(record, scores.get(_MAIN, max(scores.values(), default=0.0))),
        said=record.payload.reply or "",
        scores=scores,
        why=record.failure or record.excluded or "",
        faults=record.faults,
        seconds=round(record.seconds, 4),
        tokens=(tokens.context, tokens.cached, tokens.reply),
    )
