"""Plans and errands of an arm as samples: what was done step by step, and of some what was seen."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import msgspec
from PIL import Image

from infthor_eval.errors import InfthorError
from infthor_eval.report.web.runs import ReportRun, merged
from infthor_eval.report.web.samples import Result, Sample, StepRow, outcome
from infthor_eval.report.web.thumbnails import Thumbnails
from infthor_eval.runs import UnitKey, UnitRecord

__all__ = ["EpisodeKind", "Head", "Opener", "Stage", "episode_samples"]

Record = UnitRecord[Any]
_DRAWN, _SHOWN = 560, 300  # pixels of a map's side; drawn larger than it is shown, its letters are read better


class Stage(Protocol):
    """Where episodes of a trajectory are carried out again."""

    def moments(self, records: Sequence[Any], /) -> Iterable[Any]:
        """What there is to be seen (`sight`) and told (`note`), from each episode's start to its end."""
        ...


# Of a run, a task, a trajectory, and where data lie that do not come with the package (None where nobody says): the
# stage. It brings a simulator with it, which this room does without; who asks for the page gives it.
Opener = Callable[[ReportRun, str, str, Path | None], AbstractContextManager[Stage]]


class Head(NamedTuple):
    """What an episode is, in words.

    Attributes:
        title: what was to be done.
        kind: of plan, or of errand.
        wanted: the goal.
    """

    title: str
    kind: str
    wanted: str


@dataclass(frozen=True)
class EpisodeKind:
    """A kind of episode.

    Attributes:
        drawn: a sight as a map of so many pixels.
        head: of a record.
        rows: of a payload, its steps.
    """

    drawn: Callable[[Any, int], Image.Image]
    head: Callable[[Any], Head]
    rows: Callable[[Any], list[StepRow]]


@dataclass(frozen=True)
class _Look:
    """Numbers of an episode's pictures: before its first step and after each, and of the map at its end."""

    frames: Sequence[int | None] = ()
    map: int | None = None
    note: str = ""


@dataclass
class _Seen:
    """What was seen in episodes of one run, and why in some trajectories nothing was."""

    looks: dict[UnitKey, _Look] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


def episode_samples(
    runs: Sequence[ReportRun],
    kind: EpisodeKind,
    opened: Opener | None,
    data: Path | None,
    most: int,
    thumbnails: Thumbnails,
) -> tuple[list[Sample], list[str]]:
    """All episodes that a run has a record of, some of them with what was seen.

    Args:
        runs: of one suite.
        kind: of its episodes.
        opened: the stage on which they are carried out again; None shows nothing of what was seen.
        data: where the trajectories lie that do not come with the package; None asks each run where its were.
        most: episodes of each run that are carried out again: failed ones first, then evenly.
        thumbnails: takes what is seen.

    Returns:
        The samples, and what must be said.
    """
    seen = [_Seen() if opened is None else _seen(run, kind, opened, data, most, thumbnails) for run in runs]
    samples = [_sample(runs, kind, key, records, seen) for key, records in merged(runs).items()]
    return samples, [problem for found in seen for problem in found.problems]


def _seen(
    run: ReportRun, kind: EpisodeKind, opened: Opener, data: Path | None, most: int, thumbnails: Thumbnails
) -> _Seen:
    found = _Seen()
    chosen = sorted(_chosen(run, most), key=lambda record: (record.task, record.cluster, record.key))
    for (task, trajectory), records in groupby(chosen, key=lambda record: (record.task, record.cluster)):
        try:
            with opened(run, task, trajectory, data or run.data) as stage:
                for record in records:
                    name = f"{run.folder}/{record.key.task}/{record.key}"
                    found.looks[record.key] = _look(stage.moments([record]), kind, name, thumbnails)
        except InfthorError as error:
            found.problems.append(f"{run.label}, {trajectory}: nothing is shown: {error}")
    return found


def _chosen(run: ReportRun, most: int) -> list[Record]:
    """Those that came out wrong have most of the room, and some that came out right the rest."""
    acted = [record for record in run.records if record.payload.steps]
    wrong, right = ([record for record in acted if record.payload.done is done] for done in (False, True))
    first = _evenly(wrong, max(most - len(right), (2 * most + 2) // 3))
    return first + _evenly(right, most - len(first))


def _evenly(records: Sequence[Record], n: int) -> list[Record]:
    if len(records) <= n:
        return list(records)
    return [records[round(number * (len(records) - 1) / max(n - 1, 1))] for number in range(n)]


def _look(moments: Iterable[Any], kind: EpisodeKind, name: str, thumbnails: Thumbnails) -> _Look:
    found = list(moments)
    sights = [moment.sight for moment in found if moment.sight is not None]
    if not sights:
        return _Look()
    frames = [
        thumbnails.add(f"{name}/{number}", lambda frame=sight.frame: Image.fromarray(frame))  # type: ignore[misc]
        for number, sight in enumerate(sights)
    ]
    at_end = thumbnails.add(f"{name}/map", lambda: kind.drawn(sights[-1], _DRAWN), _SHOWN)
    return _Look(frames, at_end, next((moment.note for moment in found if moment.note), ""))


def _sample(
    runs: Sequence[ReportRun], kind: EpisodeKind, key: UnitKey, records: Sequence[Record | None], seen: Sequence[_Seen]
) -> Sample:
    first = next(record for record in records if record is not None)
    results = (
        None if record is None else _result(run, record, kind.rows(record.payload), found.looks.get(key, _Look()))
        for run, record, found in zip(runs, records, seen, strict=True)
    )
    return Sample(
        suite=runs[0].suite.name,
        task=key.task,
        id=key.id,
        variant=key.variant,
        cluster=first.cluster,
        results=tuple(results),
        **kind.head(first)._asdict(),
    )


def _result(run: ReportRun, record: Record, steps: Sequence[StepRow], look: _Look) -> Result:
    return Result(
        outcome=outcome(record, float(record.payload.done)),
        said=record.payload.ended,
        scores=run.suite.scores(record),
        why=record.failure or record.excluded or "",
        faults=record.faults,
        seconds=round(record.seconds, 4),
        tokens=(record.tokens.context, record.tokens.cached, record.tokens.reply),
        steps=tuple(_pictured(steps, look.frames)),
        first=look.frames[0] if look.frames else None,
        map=look.map,
        note=look.note,
    )


def _pictured(steps: Sequence[StepRow], frames: Sequence[int | None]) -> Iterator[StepRow]:
    for number, step in enumerate(steps, 1):
        yield msgspec.structs.replace(step, picture=frames[number]) if number < len(frames) else step
