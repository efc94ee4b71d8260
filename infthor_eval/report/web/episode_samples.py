"""Plans and errands of an arm as samples: what was done step by step, and of some what was seen."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import msgspec
from numpy.typing import NDArray
from PIL import Image

from infthor_eval.errors import InfthorError
from infthor_eval.report.web.runs import ReportRun, merged
from infthor_eval.report.web.samples import Result, Sample, StepRow, outcome
from infthor_eval.report.web.thumbnails import Thumbnails
from infthor_eval.runs import UnitKey, UnitRecord

__all__ = ["Look", "Pictured", "episode_samples", "pictured"]

Record = UnitRecord[Any]
_MAP = 300  # pixels of a map's side


@dataclass(frozen=True)
class Look:
    """What was seen in an episode, made anew.

    Attributes:
        frames: before the first step, and after each: RGB, uint8, [height, width, 3]; fewer where nobody acted.
        map: of the room, or of the arm's reach, at the end; None where nobody acted.
        note: how it went otherwise than recorded; empty where it did not.
    """

    frames: Sequence[NDArray[Any]]
    map: Image.Image | None
    note: str = ""


@dataclass
class Pictured:
    """Pictures of the episodes of one run.

    Attributes:
        looks: by unit: numbers of the thumbnails of its frames, that of its map, and the note.
        problems: why a trajectory has none.
    """

    looks: dict[UnitKey, tuple[list[int | None], int | None, str]] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


def pictured(
    run: ReportRun,
    most: int,
    thumbnails: Thumbnails,
    replayed: Callable[[str, str, Sequence[Record]], AbstractContextManager[Iterator[Look]]],
) -> Pictured:
    """Carry out some episodes of a run again, to see them.

    Args:
        run: the run.
        most: episodes at most: those that came out worst first, then evenly.
        thumbnails: takes what is seen.
        replayed: of a task and a trajectory, what is seen in some of its episodes, one after another.
    """
    found = Pictured()
    chosen = sorted(_chosen(run, most), key=lambda record: (record.task, record.cluster, record.key))
    for (task, trajectory), group in groupby(chosen, key=lambda record: (record.task, record.cluster)):
        records = list(group)
        try:
            with replayed(task, trajectory, records) as looks:
                for record, look in zip(records, looks, strict=True):
                    found.looks[record.key] = _kept(run, record, look, thumbnails)
        except InfthorError as error:
            found.problems.append(f"{run.label}, {trajectory}: nothing is shown: {error}")
    return found


def _chosen(run: ReportRun, most: int) -> list[Record]:
    acted = [record for record in run.records if record.payload.steps]
    wrong = [record for record in acted if not record.payload.done]
    right = [record for record in acted if record.payload.done]
    first = _evenly(wrong, max(most - len(right), (most + 1) // 2))
    return first + _evenly(right, most - len(first))


def _evenly(records: Sequence[Record], n: int) -> list[Record]:
    if n <= 0 or len(records) <= n:
        return list(records) if n > 0 else []
    return [records[round(number * (len(records) - 1) / max(n - 1, 1))] for number in range(n)]


def _kept(
    run: ReportRun, record: Record, look: Look, thumbnails: Thumbnails
) -> tuple[list[int | None], int | None, str]:
    name = f"{run.folder}/{record.key.task}/{record.key}"
    frames = [
        thumbnails.add(f"{name}/{number}", lambda frame=frame: Image.fromarray(frame))  # type: ignore[misc]
        for number, frame in enumerate(look.frames)
    ]
    drawn = look.map
    at_end = None if drawn is None else thumbnails.add(f"{name}/map", lambda: drawn, _MAP)
    return frames, at_end, look.note


def episode_samples(
    runs: Sequence[ReportRun],
    seen: Sequence[Pictured],
    head: Callable[[Record], Mapping[str, str]],
    rows: Callable[[Any], list[StepRow]],
) -> list[Sample]:
    """All episodes that a run has a record of.

    Args:
        runs: of one suite.
        seen: of each of them.
        head: title, kind and what was wanted, of a record.
        rows: of a payload, its steps.
    """
    samples = []
    for key, records in merged(runs).items():
        first = next(record for record in records if record is not None)
        results = (
            None if record is None else _result(run, record, rows(record.payload), pictures)
            for run, record, pictures in zip(runs, records, seen, strict=True)
        )
        samples.append(
            Sample(
                suite=runs[0].suite.name,
                task=key.task,
                id=key.id,
                variant=key.variant,
                cluster=first.cluster,
                results=tuple(results),
                **head(first),
            )
        )
    return samples


def _result(run: ReportRun, record: Record, steps: Sequence[StepRow], seen: Pictured) -> Result:
    frames, drawn, note = seen.looks.get(record.key, ([], None, ""))
    pictured_steps = (
        msgspec.structs.replace(step, picture=frames[number] if number < len(frames) else None)
        for number, step in enumerate(steps, 1)
    )
    tokens = record.tokens
    return Result(
        outcome=outcome(record, float(record.payload.done)),
        said=record.payload.ended,
        scores=run.suite.scores(record),
        why=record.failure or record.excluded or "",
        faults=record.faults,
        seconds=round(record.seconds, 4),
        tokens=(tokens.context, tokens.cached, tokens.reply),
        steps=tuple(pictured_steps),
        first=frames[0] if frames else None,
        map=drawn,
        note=note,
    )
