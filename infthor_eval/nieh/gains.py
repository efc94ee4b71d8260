"""Gains over blank frames: how much higher a model scores with frames than without, by the wording alone."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.summary import NiehSummary, TaskSummary
from infthor_eval.runs import RunSummary
from infthor_eval.statistics import MeanEstimate, paired_difference

__all__ = ["Gain", "find_gains", "frames_of", "name_of"]

_BLANK = "blank"


@dataclass(frozen=True)
class Gain:
    """The gain of one run over its run on blank frames, in one task under one scorer.

    Attributes:
        run: the run with frames.
        task: name of the task.
        metric: name of the scorer.
        seeing: summary of the task with frames.
        blind: summary of the task on blank frames.
    """

    run: RunSummary
    task: str
    metric: str
    seeing: TaskSummary
    blind: TaskSummary

    def in_column(self, column: str) -> float | None:
        """Return the gain for a number of clues or in total, between -1 and 1; None if nothing was asked."""
        seeing, blind = self.seeing.by_clues[column], self.blind.by_clues[column]
        if not seeing.n or not blind.n:
            return None
        return seeing.scores[self.metric].mean - blind.scores[self.metric].mean

    def total(self) -> MeanEstimate | None:
        """Return the mean gain with its interval, paired by question, clustered by trajectory; None without questions.

        Runs whose configs differ in their frames only ask the same questions, in the same order.
        """
        seeing, blind = self.seeing.scores[self.metric], self.blind.scores[self.metric]
        clusters = [trajectory for trajectory, scores in seeing.items() for _ in scores]
        if not clusters:
            return None
        ours, theirs = ([score for trajectory in seeing for score in scores[trajectory]] for scores in (seeing, blind))
        return paired_difference(theirs, ours, clusters).estimate


def find_gains(runs: Sequence[RunSummary]) -> Iterator[Gain]:
    """Yield the gains of every run that has a run on blank frames with otherwise the same config among the runs."""
    for run in runs:
        for blind in runs:
            if frames_of(run) != _BLANK and frames_of(blind) == _BLANK and _differ_in_frames_only(run, blind):
                yield from _gains_of_pair(run, blind)


def _gains_of_pair(run: RunSummary, blind: RunSummary) -> Iterator[Gain]:
    assert isinstance(run.summary, NiehSummary)
    assert isinstance(blind.summary, NiehSummary)
    for name, task in run.summary.tasks.items():
        for metric in task.metrics:
            yield Gain(run, name, metric, task, blind.summary.tasks[name])


def frames_of(run: RunSummary) -> str:
    """Return the frame ablation of a run."""
    return str(run.header.config["frames"])


def name_of(run: RunSummary) -> str:
    """Return the name of a run, with its frame ablation."""
    frames = frames_of(run)
    return run.header.name if frames == SHOWN else f"{run.header.name}, {frames} frames"


def _differ_in_frames_only(run: RunSummary, blind: RunSummary) -> bool:
    return _without_frames(run) == _without_frames(blind)


def _without_frames(run: RunSummary) -> dict[str, Any]:
    return {name: value for name, value in run.header.config.items() if name != "frames"}
