"""Scores of today's scorers over the replies in a run's journal, as a run of its own.

The journal alone is needed: its records have the gold answers. So runs can be scored again whose
model or set is no longer there, and runs of imported replies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from msgspec.structs import replace

import infthor_eval
from infthor_eval.nieh.config import (
    MetricsConfig,
    NiehConfig,
    NiehTaskConfig,
    RescoredConfig,
    SourceRun,
)
from infthor_eval.nieh.own_scorers import OwnScorer, OwnScores
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.judging import JUDGED, Judge, Judgement, Track, judge_replies
from infthor_eval.nieh.rescoring.report import RescoringReport, find_changes
from infthor_eval.nieh.scoring import SCORERS, scores
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.questions.asking import MetricError
from infthor_eval.runs import (
    NOTHING,
    RunHeader,
    Session,
    StoredRequest,
    Unit,
    UnitRecord,
    keep_request,
)
from infthor_eval.runs.results import Stored, write_document
from infthor_eval.runs.stored.writing import store_run

RESCORED = "rescored.json"  # in the run's folder: what has changed

_SUFFIX = "-rescored"  # of the run's name

Record = UnitRecord[NiehAnswer]


@dataclass(frozen=True)
class Source:
    """A run whose replies are scored again.

    Attributes:
        records: the latest record of each unit.
        requests: the stored requests by the names that records have for them.
    """

    header: RunHeader[NiehConfig]
    records: Sequence[Record]
    requests: Mapping[str, StoredRequest] = field(default_factory=dict)

    @property
    def n_missing(self) -> int:
        """Number of units without a record."""
        return sum(self.units_by_task.values()) - len(self.records)

    @property
    def units_by_task(self) -> dict[str, int]:
        """Number of units of each task."""
        config = self.header.config
        return {name: task.n_samples * config.repeats for name, task in config.tasks.items()}

    @property
    def replied(self) -> list[Record]:
        """The records with a reply."""
        return [record for record in self.records if record.payload.reply is not None]


@dataclass(frozen=True)
class Rescored:
    """A run with today's scores, stored.

    Attributes:
        run: its folder, summary and usage.
        report: what has changed.
        records: its records.
        judgement: what the judge says; None for no judge.
    """

    run: Stored
    report: RescoringReport
    records: Sequence[Record]
    judgement: Judgement | None


@dataclass(frozen=True)
class Rescoring:
    """A run with today's scores, before it is stored.

    Attributes:
        source: the run that it comes from.
        scorer: a scorer of one's own; None for none.
        own: its scores; None for none.
        judge: the judge; None for none.
    """

    source: Source
    scorer: OwnScorer | None
    own: OwnScores | None
    judge: Judge | None

    @property
    def names(self) -> tuple[str, ...]:
        """The metrics."""
        return (*SCORERS, *(self.own.names if self.own else ()), *((JUDGED,) if self.judge else ()))

    @cached_property
    def header(self) -> RunHeader[NiehConfig]:
        """The header of the run: that of its source, with what it comes from and who scores it."""
        source = self.source.header
        metrics = MetricsConfig(names=self.names)
        tasks = {name: replace(task, metrics=metrics) for name, task in source.config.tasks.items()}
        config = replace(
            source.config,
            infthor_eval=infthor_eval.__version__,
            tasks=tasks,
            rescored=RescoredConfig(
                source=SourceRun(source.name, source.config.hash),
                scorer=self._scorer_config(),
                judge=self.judge.config() if self.judge else None,
            ),
        )
        name = f"{source.name.removesuffix(_SUFFIX)}{_SUFFIX}"
        return RunHeader(
            suite=source.suite, name=name, config=config, units_by_task=self.source.units_by_task
        )

    def store(self, output: Path, track: Track = list) -> Rescored:
        """Score the replies and store the run below a folder, with `rescored.json`.

        Args:
            output: folder above those of runs.
            track: see `judge_replies`.
        """
        records: list[Record] = []
        judgements: list[Judgement] = []

        def make_records(session: Session[NiehAnswer]) -> list[Record]:
            records.extend(self._score(record, session) for record in self.source.records)
            for request in self.source.requests.values():
                keep_request(request, session)
            if self.judge is not None:
                judgements.append(judge_replies(records, self.judge, session, track))
                records[:] = [_with_verdict(record, judgements[0]) for record in records]
            return records

        run = store_run(output, self.header, NiehSuite(), make_records, self.source.n_missing)
        judgement = judgements[0] if judgements else None
        report = self._report(records, judgement)
        write_document(run.folder / RESCORED, report)
        return Rescored(run, report, records, judgement)

    def _scorer_config(self) -> dict[str, Any] | None:
        if self.scorer is None or self.own is None:
            return None
        return {"name": self.scorer.name, "metrics": list(self.own.names), **self.scorer.source}

    def _score(self, record: Record, session: Session[NiehAnswer]) -> Record:
        """Return a record with today's scores; failed without a reply, or if a scorer fails."""
        today = replace(record, usage=NOTHING, attempt=1)
        if record.payload.reply is None:
            return today
        own = self.own.by_unit[record.key] if self.own else {}
        if isinstance(own, MetricError):
            failure = session.describe_failure(
                Unit(record.key, record.cluster, record.payload), own
            )
            return replace(_with_scores(today, {}), failure=failure)
        by_rule = scores(record.payload.reply, record.payload.answers)
        return replace(_with_scores(today, by_rule | own), failure=None)

    def _left_out(self, task: NiehTaskConfig) -> list[str]:
        return [metric for metric in task.metrics.names if metric not in self.names]

    def _report(self, records: Sequence[Record], judgement: Judgement | None) -> RescoringReport:
        before = {record.key: record.payload.scores for record in self.source.records}
        tasks = self.source.header.config.tasks
        left_out = {name: self._left_out(task) for name, task in tasks.items()}
        by_task: dict[str, list[Record]] = {name: [] for name in tasks}
        for record in records:
            by_task[record.task].append(record)
        n_scored = sum(bool(record.payload.scores) for record in records)
        return RescoringReport(
            n_scored=n_scored,
            n_without_reply=len(records) - len(self.source.replied),
            n_failed=len(self.source.replied) - n_scored,
            n_missing=self.source.n_missing,
            left_out={task: names for task, names in left_out.items() if names},
            tasks={name: find_changes(before, by_task[name], self.names) for name in tasks},
            judge=judgement.agreement if judgement else None,
        )


def score_again(
    source: Source, scorer: OwnScorer | None = None, judge: Judge | None = None
) -> Rescoring:
    """Set up a run with both scorers' scores today, and those of an own scorer and a judge if
    any."""
    own = scorer.score_all(source.replied, (*SCORERS, JUDGED)) if scorer else None
    return Rescoring(source, scorer, own, judge)


def _with_verdict(record: Record, judgement: Judgement) -> Record:
    if record.key not in judgement.scores:
        return record
    return _with_scores(record, record.payload.scores | {JUDGED: judgement.scores[record.key]})


def _with_scores(record: Record, by_metric: dict[str, float]) -> Record:
    return replace(record, payload=replace(record.payload, scores=by_metric))
