"""From records to samples: what was asked, and the result of each run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from infthor_eval.report.descriptions import StepRow
from infthor_eval.report.runs import records_by_unit
from infthor_eval.report.sample import Sample
from infthor_eval.report.web.replays import EpisodePictures, EpisodeReplays
from infthor_eval.report.web.sample_groups import GroupKey, group_samples
from infthor_eval.report.web.samples import (
    FrameFacts,
    Numbered,
    PageSample,
    PageStep,
    Prompt,
    SampleResult,
    Timeline,
)
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.runs.journals.shards import FOLDER
from infthor_eval.runs.journals.tracebacks import StoredTracebacks

Record = UnitRecord[Any]
_OF_BASELINES = "a baseline is not sent it: it answers from the questions alone"


class SuiteSamples(NamedTuple):
    """Samples of the runs of a suite.

    Attributes:
        samples: samples of all units that have a record, in the order of their keys; those of a
            group are one (`PlainPresenter.group`).
        notes: reasons why pictures are missing, a line each.
    """

    samples: list[PageSample]
    notes: list[str]


@dataclass(frozen=True)
class SharedTexts:
    """What samples refer to by number, as many samples have the same: texts, facts of frames."""

    prompts: Numbered[Prompt] = field(default_factory=Numbered)
    tracebacks: Numbered[str] = field(default_factory=Numbered)
    explanations: Numbered[str] = field(default_factory=Numbered)
    frames: Numbered[FrameFacts] = field(default_factory=Numbered)


def build_samples(
    runs: Sequence[Run],
    data: Path | None,
    replays: EpisodeReplays,
    thumbnails: ThumbnailStore,
    texts: SharedTexts,
) -> SuiteSamples:
    """Build the samples of runs.

    Args:
        runs: runs of one suite.
        data: folder of the data set; None for the one that each run names.
        replays: replays some of the episodes.
        thumbnails: collects the pictures.
        texts: collects prompts, tracebacks, and what is known of frames.
    """
    presenter = runs[0].presenter
    timelines = presenter.timelines(runs, data, thumbnails)
    fact_numbers = list(map(texts.frames.number, timelines.facts))
    timeline_of = {
        key: timeline.renumbered(fact_numbers) for key, timeline in timelines.by_unit.items()
    }
    replayed = [replays.replay(run) for run in runs]
    sources = [_Source(run, StoredTracebacks(run.folder / FOLDER), texts) for run in runs]
    samples = []
    for key, records in records_by_unit(runs).items():
        pictures = [of_run.get(key) for of_run, _ in replayed]
        sample = _sample(key, sources, records, pictures, timeline_of)
        name = presenter.group(next(record for record in records if record is not None))
        samples.append((GroupKey(key.task, key.variant, key.repeat, name), sample))
    notes = [*timelines.notes, *(note for _, notes in replayed for note in notes)]
    return SuiteSamples(group_samples(samples), notes)


@dataclass(frozen=True)
class _Source:
    """A run with the texts of its samples that are there once."""

    run: Run
    tracebacks: StoredTracebacks
    texts: SharedTexts

    def prompt(self, sample: Sample) -> int | None:
        requests = self.run.requests(sample.record)
        if not requests:
            prompt = Prompt(problem=sample.request_problem)
            return None if self.run.is_baseline else self.texts.prompts.number(prompt)
        number = None
        for request in requests:
            note = _OF_BASELINES if self.run.is_baseline else ""
            prompt = Prompt(tuple(request.parts), request.shown, number, note=note)
            number = self.texts.prompts.number(prompt)
        return number

    def traceback(self, record: Record) -> int | None:
        text = "" if record.failure is None else self.tracebacks.find(record.key, record.attempt)
        return self.texts.tracebacks.number(text) if text else None

    def explanation(self, record: Record) -> int | None:
        lines = self.run.presenter.explain(record)
        return self.texts.explanations.number("\n".join(lines)) if lines else None


def _sample(
    key: UnitKey,
    sources: Sequence[_Source],
    records: Sequence[Record | None],
    pictures: Sequence[EpisodePictures | None],
    timelines: Mapping[UnitKey, Timeline],
) -> PageSample:
    first = next(record for record in records if record is not None)
    results = (
        None if record is None else _result(source, record, episode_pictures or EpisodePictures())
        for source, record, episode_pictures in zip(sources, records, pictures, strict=True)
    )
    first_run = sources[0].run
    return PageSample(
        suite=first_run.suite.name,
        task=key.task,
        id=key.id,
        variant=" ".join(
            filter(None, (key.variant, f"answer {key.repeat}" if key.repeat > 1 else ""))
        ),
        cluster=first.cluster,
        results=tuple(results),
        timeline=timelines.get(key),
        **first_run.presenter.describe(first)._asdict(),
    )


def _result(source: _Source, record: Record, pictures: EpisodePictures) -> SampleResult:
    sample = Sample(source.run, record)
    tokens = record.tokens
    return SampleResult(
        outcome=sample.outcome,
        reply=sample.reply,
        scores=source.run.suite.scores(record),
        reason=sample.reason,
        faults=record.faults,
        seconds=round(record.seconds, 4),
        tokens=(tokens.context, tokens.cached, tokens.reply),
        details=sample.details,
        steps=_with_pictures(sample.steps, pictures.frames),
        start=pictures.frames[0] if pictures.frames else None,
        map=pictures.map,
        note=pictures.note,
        prompt=source.prompt(sample),
        traceback=source.traceback(record),
        why=source.explanation(record),
        recalled=tuple(source.run.presenter.recalled(record)),
    )


def _with_pictures(steps: Sequence[StepRow], frames: Sequence[int | None]) -> tuple[PageStep, ...]:
    """The first frame is the start; an episode that ends early in the replay has fewer frames than
    steps."""
    return tuple(
        PageStep(**msgspec.structs.asdict(step), picture=picture)
        for step, picture in zip_longest(steps, frames[1 : len(steps) + 1])
    )
