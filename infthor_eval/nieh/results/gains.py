"""Gains by frames: how much higher a model scores with some frames than with others or with none.

Runs are set side by side if they are alike but for their frames.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.options import BLANK, SHOWN
from infthor_eval.nieh.results.summary import TaskSummary
from infthor_eval.runs import RunSummary
from infthor_eval.statistics import MeanEstimate, paired_difference
from infthor_eval.tables import TableCell, answered_cell, interval_cell

Scores = Mapping[str, Mapping[str, float]]
"""Scores by trajectory and sample."""


@dataclass(frozen=True)
class Gain:
    """The gain of a run over its run that sees less, in one task under one scorer."""

    run: RunSummary
    task: str
    metric: str
    seeing: TaskSummary
    blank: TaskSummary

    def in_column(self, column: str) -> float | None:
        """Return the gain for a number of clues, -1 to 1; None unless both runs answered all
        questions, of which there are some."""
        seeing = self.seeing.by_clues[column]
        blank = self.blank.by_clues[column]
        if not (seeing.n_answered == seeing.n == blank.n_answered == blank.n > 0):
            return None
        return seeing.scores[self.metric].mean - blank.scores[self.metric].mean

    def total(self) -> MeanEstimate | None:
        """Return mean gain and interval over the questions that both runs answered, paired and
        clustered by trajectory; None if there are none."""
        return paired_gain(self.seeing.scores[self.metric], self.blank.scores[self.metric])

    @property
    def n_all(self) -> int:
        """Number of questions that both runs were to answer."""
        return self.seeing.total.n


def paired_gain(ours: Scores, theirs: Scores) -> MeanEstimate | None:
    """Return by how much our scores are higher, over the samples that both have, paired and
    clustered by trajectory; None if there are none."""
    shared = [
        (trajectory, score, theirs[trajectory][sample])
        for trajectory, scores in ours.items()
        for sample, score in scores.items()
        if sample in theirs.get(trajectory, {})
    ]
    if not shared:
        return None
    clusters, our, their = zip(*shared, strict=True)
    # The reference scorer exceeds 1 on repetitions.
    most = 1.0 if max(*our, *their) <= 1 else None
    return paired_difference(their, our, clusters, most).estimate


def find_gains(runs: Sequence[RunSummary]) -> Iterator[Gain]:
    """Yield the gain of every run that has a run on blank frames, equal but for that, beside it."""
    for run in runs:
        for blank in runs:
            is_pair = frames_of(run) != BLANK and frames_of(blank) == BLANK
            if is_pair and _without_frames(run) == _without_frames(blank):
                for name, task in run.summary.tasks.items():
                    yield from (
                        Gain(run, name, m, task, blank.summary.tasks[name]) for m in task.metrics
                    )


def alike_but_for_frames(runs: Sequence[RunSummary]) -> list[dict[str, RunSummary]]:
    """Return the groups of runs that differ in their frames alone: of each group by its frames."""
    groups: list[tuple[NiehConfig, dict[str, RunSummary]]] = []
    for run in runs:
        config = _without_frames(run)
        group = next((group for known, group in groups if known == config), None)
        if group is None:
            group = {}
            groups.append((config, group))
        group.setdefault(frames_of(run), run)
    return [group for _, group in groups]


def frames_of(run: RunSummary) -> str:
    """Return the frame ablation of a run."""
    return str(run.header.config.frames)


def name_of(run: RunSummary) -> str:
    """Return the name of a run, with its frame ablation."""
    frames = frames_of(run)
    return run.header.name if frames == SHOWN else f"{run.header.name}, {frames} frames"


def _without_frames(run: RunSummary) -> NiehConfig:
    config: NiehConfig = run.header.config
    rescored = config.rescored
    if rescored is not None:  # from runs that differ in their frames
        rescored = replace(rescored, source=None)
    tasks = {name: replace(task, without_alike=()) for name, task in config.tasks.items()}
    return replace(config, frames="", rescored=rescored, tasks=tasks)


def gain_cell(gain: Gain | None) -> TableCell:
    """Return a difference in points with its interval, which one trajectory alone has not."""
    return difference_cell(None, 0) if gain is None else difference_cell(gain.total(), gain.n_all)


def difference_cell(total: MeanEstimate | None, n_all: int) -> TableCell:
    """Return a difference in points with its interval, of so many samples if all are answered."""
    if total is None:
        return TableCell("-", {"": "", "low": "", "high": ""})
    low, high = (None if end is None else 100 * end for end in (total.low, total.high))
    interval = interval_cell(low, high, "+.1f")
    mean = answered_cell(f"{100 * total.mean:+.1f}", total.n, n_all)
    numbers = {"": "", **interval.numbers, **mean.numbers}
    return TableCell(mean if low is None else f"{mean} {interval}", numbers)
