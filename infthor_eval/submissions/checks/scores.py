"""The scores that a submission says, against those of its replies."""

from collections.abc import Iterator, Sequence
from typing import ClassVar

from infthor_eval.nieh.config import MetricsConfig
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import SCORERS, scores
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.runs import RunSummary, UnitRecord
from infthor_eval.runs.stored.search import read_results
from infthor_eval.submissions.case import Case, count
from infthor_eval.submissions.reading import Problem, SubmittedRun

__all__ = ["SameResults", "SameScorers", "SameScores"]

_TOLERANCE = 1e-6  # of scores that went through another format's decimals
_FAILED = 0.0  # what exports write for a failed unit

Record = UnitRecord[NiehAnswer]


class SameScorers:
    """The metrics of a run are those of its installed task."""

    name: ClassVar[str] = "scorers"
    reason: ClassVar[str] = "a scorer of one's own under our scorers' names"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.tasks:
            theirs = task.run.header.config.tasks[task.name].metrics
            if task.config is not None and _code(theirs) != _code(task.config.metrics):
                yield Problem(
                    self.name,
                    f"{task.name}: was scored by other scorers than the installed task's; run that "
                    "task",
                )


def _code(metrics: MetricsConfig) -> tuple[object, ...]:
    """Return what tells scorers apart; rules of another version show in the scores."""
    return sorted(metrics.names), metrics.process_results, metrics.source


class SameScores:
    """Each stored score is the one of its reply."""

    name: ClassVar[str] = "scores"
    reason: ClassVar[str] = "what is stored counts for nothing, but who edits it edits more"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for run in case.submission.runs:
            edited = [str(record.key) for record in run.records if _is_edited(run, record)]
            if edited:
                yield Problem(
                    self.name,
                    f"{run.path.name}: {count('stored scores', edited)} are not those of their "
                    "replies",
                )


def _is_edited(run: SubmittedRun, record: Record) -> bool:
    told = run.told.get(record.key, {})
    reply = record.payload.reply
    if record.failure is not None or reply is None:
        return any(told.get(name, _FAILED) != _FAILED for name in SCORERS)
    if not told and not run.is_export:
        return True  # an answered unit of a journal has its scores
    right = scores(reply, record.payload.answers)
    return any(abs(told[name] - right[name]) > _TOLERANCE for name in SCORERS if name in told)


class SameResults:
    """`results.json` says what the records do."""

    name: ClassVar[str] = "results"
    reason: ClassVar[str] = "a summary that its own records do not give"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        suite = NiehSuite()
        for run in case.submission.runs:
            stored = None if run.is_export else read_results(run.path)
            if stored is None:
                continue
            summary = RunSummary.of(suite, run.header, run.records)
            for task, rate in suite.primary_metrics(summary.summary).items():
                told = stored.primary_metrics.get(task)
                if told is None or abs(told.mean - rate.mean) > _TOLERANCE:
                    yield Problem(
                        self.name,
                        f"{run.path.name}: results.json has "
                        f"{'no score' if told is None else f'{100 * told.mean:.2f} %'} for {task}, "
                        f"its records give {100 * rate.mean:.2f} %",
                    )
