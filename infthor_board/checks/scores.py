"""The scores that a submission says, against those of its replies."""

from collections.abc import Iterator, Sequence
from statistics import fmean
from typing import ClassVar

from infthor_board.case import Case, count
from infthor_board.exports import read_exported_means
from infthor_board.reading import Problem, SubmittedRun
from infthor_eval.formats.reading import json_lines_of
from infthor_eval.nieh.config import MetricsConfig
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.scoring import SCORERS, scores
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.runs import RunSummary, UnitRecord
from infthor_eval.runs.stored.search import read_results

_TOLERANCE = 1e-6  # of scores that went through another format's decimals
_ROUNDED = 1e-4  # of means that others may have rounded
_SCORES = "scores.jsonl"
_HINT = "send the run as it was written"
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
    reason: ClassVar[str] = "stored scores are not used, but edited ones cast doubt on the replies"

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
    stated = run.stated.get(record.key, {})
    reply = record.payload.reply
    if record.failure is not None or reply is None:
        return any(stated.get(name, _FAILED) != _FAILED for name in SCORERS)
    if not stated and not run.is_export:
        return True  # an answered unit of a journal has its scores
    right = scores(reply, record.payload.answers)
    return any(abs(stated[name] - right[name]) > _TOLERANCE for name in SCORERS if name in stated)


class SameResults:
    """What is summed up beside the replies is what they give."""

    name: ClassVar[str] = "results"
    reason: ClassVar[str] = "a summary that its own replies do not give"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for run in case.submission.runs:
            texts = self._of_export(run) if run.is_export else self._of_journal(run)
            yield from (Problem(self.name, f"{run.path.name}: {text}") for text in texts)

    @staticmethod
    def _of_journal(run: SubmittedRun) -> Iterator[str]:
        stored = read_results(run.path)
        suite = NiehSuite()
        if stored is not None:
            summary = RunSummary.of(suite, run.header, run.records)
            for task, rate in suite.primary_metrics(summary.summary).items():
                stated = stored.primary_metrics.get(task)
                if stated is None or abs(stated.mean - rate.mean) > _TOLERANCE:
                    said = "no score" if stated is None else f"{100 * stated.mean:.2f} %"
                    yield (
                        f"results.json has {said} for {task}, its records give "
                        f"{100 * rate.mean:.2f} %"
                    )
        path = run.path / _SCORES
        if path.is_file() and not path.is_symlink():
            ours = [dict(suite.scores(record)) for record in run.records]
            theirs = [row.get("scores") for row in json_lines_of(path, _HINT)]
            if theirs != ours:
                yield f"{_SCORES} has other scores than the journal"

    @staticmethod
    def _of_export(run: SubmittedRun) -> Iterator[str]:
        for (task, metric), stated in read_exported_means(run.path).items():
            records = [record for record in run.records if record.task == task]
            given = [it.payload.scores.get(metric) for it in records]
            known = [score for score in given if score is not None]
            if not known:
                continue
            mean = fmean(known)  # failed units are in no mean
            if abs(stated - mean) > _ROUNDED:
                yield (
                    f"its results have {100 * stated:.2f} % for {task} ({metric}), its replies "
                    f"give {100 * mean:.2f} %"
                )
