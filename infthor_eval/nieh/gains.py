"""What runs score above the same model's run on blank frames: what sight adds to wording."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.summary import NiehSummary, TaskSummary
from infthor_eval.runs import RunSummary
from infthor_eval.statistics import MeanEstimate, paired_difference

__all__ = ["Gain", "frames_of", "gains", "name_of"]

_BLANK = "blank"


@dataclass(frozen=True)
class Gain:
    """Of one run, in one task, by one scorer.

    Attributes:
        run: the one with frames.
        task: the task's name.
        metric: the scorer.
        seeing: what was found with frames.
        blind: what was found without.
    """

    run: RunSummary
    task: str
    metric: str
    seeing: TaskSummary
    blind: TaskSummary

    def of(self, column: str) -> float | None:
        """By a number of clues, or in total; between -1 and 1. None where nothing was asked."""
        seeing, blind = self.seeing.by_clues[column], self.blind.by_clues[column]
        if not seeing.n or not blind.n:
            return None
        return seeing.scores[self.metric].mean - blind.scores[self.metric].mean

    def total(self) -> MeanEstimate | None:
        """The mean gain with its interval, paired by question and clustered by trajectory; None where none was asked.

        Runs of one identity but for their frames ask the same questions, in the same order.
        """
        seeing, blind = self.seeing.scores[self.metric], self.blind.scores[self.metric]
        clusters = [trajectory for trajectory, found in seeing.items() for _ in found]
        if not clusters:
            return None
        ours, theirs = ([score for trajectory in seeing for score in scores[trajectory]] for scores in (seeing, blind))
        return paired_difference(theirs, ours, clusters).estimate


def gains(runs: Sequence[RunSummary]) -> Iterator[Gain]:
    """Of every run that has one of the same identity on blank frames beside it, task by task and scorer by scorer."""
    for run in runs:
        for blind in runs:
            if frames_of(run) != _BLANK and frames_of(blind) == _BLANK and _same_but_for_frames(run, blind):
                yield from _gains(run, blind)


def _gains(run: RunSummary, blind: RunSummary) -> Iterator[Gain]:
    assert isinstance(run.summary, NiehSummary)
    assert isinstance(blind.summary, NiehSummary)
    for name, task in run.summary.tasks.items():
        for metric in task.metrics:
            yield Gain(run, name, metric, task, blind.summary.tasks[name])


def frames_of(run: RunSummary) -> str:
    """What was shown in the frames' places."""
    return str(run.header.config["frames"])


def name_of(run: RunSummary) -> str:
    """A run's name, with what it was shown instead of frames."""
    frames = frames_of(run)
    return run.header.name if frames == SHOWN else f"{run.header.name}, {frames} frames"


def _same_but_for_frames(run: RunSummary, blind: RunSummary) -> bool:
    return _without_frames(run) == _without_frames(blind)


def _without_frames(run: RunSummary) -> dict[str, Any]:
    return {name: value for name, value in run.header.config.items() if name != "frames"}
