"""From records to samples: what was asked, and the result of each run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from infthor_eval.report.runs import ReportRun, records_by_unit
from infthor_eval.report.web.replays import EpisodePictures, EpisodeReplays
from infthor_eval.report.web.samples import FrameFacts, PageSample, SampleResult, StepRow, Timeline
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.runs import UnitKey, UnitRecord

__all__ = ["SuiteSamples", "build_samples"]

Record = UnitRecord[Any]


class SuiteSamples(NamedTuple):
    """Samples of the runs of a suite.

    Attributes:
        samples: samples of all units that have a record, in the order of their keys.
        notes: reasons why pictures are missing, a line each.
        facts: what is known of frames, by the numbers of their thumbnails.
    """

    samples: list[PageSample]
    notes: list[str]
    facts: Mapping[int, FrameFacts]


def build_samples(
    runs: Sequence[ReportRun], data: Path | None, replays: EpisodeReplays, thumbnails: ThumbnailStore
) -> SuiteSamples:
    """Build the samples of runs.

    Args:
        runs: runs of one suite.
        data: folder of the data set; None for the one that each run names.
        replays: replays some of the episodes.
        thumbnails: collects the pictures.
    """
    timelines = runs[0].presenter.timelines(runs, data, thumbnails)
    replayed = [replays.replay(run) for run in runs]
    samples = [
        _sample(key, runs, records, [pictures.get(key) for pictures, _ in replayed], timelines.by_unit)
        for key, records in records_by_unit(runs).items()
    ]
    notes = [*timelines.notes, *(note for _, notes in replayed for note in notes)]
    return SuiteSamples(samples, notes, timelines.facts)


def _sample(
    key: UnitKey,
    runs: Sequence[ReportRun],
    records: Sequence[Record | None],
    pictures: Sequence[EpisodePictures | None],
    timelines: Mapping[UnitKey, Timeline],
) -> PageSample:
    first = next(record for record in records if record is not None)
    results = (
        None if record is None else _result(run, record, shown or EpisodePictures())
        for run, record, shown in zip(runs, records, pictures, strict=True)
    )
    return PageSample(
        suite=runs[0].suite.name,
        task=key.task,
        id=key.id,
        variant=" ".join(filter(None, (key.variant, f"answer {key.repeat}" if key.repeat > 1 else ""))),
        cluster=first.cluster,
        results=tuple(results),
        timeline=timelines.get(key),
        **runs[0].presenter.describe(first)._asdict(),
    )


def _result(run: ReportRun, record: Record, pictures: EpisodePictures) -> SampleResult:
    presenter, tokens = run.presenter, record.tokens
    return SampleResult(
        outcome=run.outcome(record),
        reply=presenter.reply(record),
        scores=run.suite.scores(record),
        reason=record.failure or record.excluded or "",
        faults=record.faults,
        seconds=round(record.seconds, 4),
        tokens=(tokens.context, tokens.cached, tokens.reply),
        details=presenter.details(record),
        steps=_with_pictures(presenter.steps(record), pictures.frames),
        start=pictures.frames[0] if pictures.frames else None,
        map=pictures.map,
        note=pictures.note,
    )


def _with_pictures(steps: Sequence[StepRow], frames: Sequence[int | None]) -> tuple[StepRow, ...]:
    """The first frame is the start; an episode that ends early in the replay has fewer frames than steps."""
    return tuple(
        msgspec.structs.replace(step, picture=frames[number]) if number < len(frames) else step
        for number, step in enumerate(steps, 1)
    )
