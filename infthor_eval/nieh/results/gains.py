"""Runs that are alike but for their frames, side by side: gains by frames, and controls.

A gain is how much higher a model scores with some frames than with others or with none. Controls
tell what of a score is memory of this home, and what knowledge of homes. All are defined in
docs/reference/metrics.md.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.options import BLANK, NO_CLUE, OTHER, SHOWN
from infthor_eval.nieh.results.cells import mean_cell
from infthor_eval.nieh.results.summary import CLUE_COLUMNS, OPEN_ENDED, TaskSummary, main_metric
from infthor_eval.rates import format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.statistics import MeanEstimate, paired_difference
from infthor_eval.tables import Column, Row, Table, TableCell, answered_cell, interval_cell

Scores = Mapping[str, Mapping[str, float]]
"""Scores by trajectory and sample."""
_FRAMES = (SHOWN, NO_CLUE, OTHER, BLANK)
_DIFFERENCES = ((SHOWN, NO_CLUE), (OTHER, BLANK))  # memory, knowledge
_OF_CONTROLS = (
    "Accuracy, %, by the main scorer: with the true frames; without the clue frames (blank ones in "
    "their place where no other is shown, or a memory recalls); with another home's of the same "
    "kind of room; with blank ones.",
    "memory: shown minus no-clue. knowledge of homes: other minus blank. In points, with the 95 % "
    "interval, paired by question and clustered by trajectory.",
)
_ON_CLUES = (
    "On the clue frames alone no-clue is blank, so its difference has knowledge of homes in it: "
    "what is of this home there is shown minus other."
)
_PAIRS = (
    "net pairs: pairs right less pairs exchanged, %. Who sees the same in both worlds has 0, "
    "whatever it knows of homes."
)

_Controls = Mapping[str, RunSummary]  # runs that are alike but for the frames, by these


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


def _alike_but_for_frames(runs: Sequence[RunSummary]) -> list[dict[str, RunSummary]]:
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
    low, high = _in_percent(total)
    interval = interval_cell(low, high, "+.1f")
    mean = answered_cell(f"{100 * total.mean:+.1f}", total.n, n_all)
    numbers = {"": "", **interval.numbers, **mean.numbers}
    return TableCell(mean if low is None else f"{mean} {interval}", numbers)


def _in_percent(total: MeanEstimate) -> tuple[float | None, ...]:
    """Return the ends of the interval, which one trajectory alone has not."""
    return tuple(None if end is None else 100 * end for end in (total.low, total.high))


def gains_table(runs: Sequence[RunSummary]) -> list[Table]:
    """Return a table of each run's gain over its run on blank frames, if there is a pair."""
    rows = [
        Row((gain.run.header.label, gain.task, gain.metric, *_gain_cells(gain)))
        for gain in find_gains(runs)
    ]
    if not rows:
        return []
    note = (
        "95 %: of the total, paired by question and clustered by trajectory, as `infthor-eval "
        "compare` has it."
    )
    title = "Gain over the same model's run on blank frames, in points"
    names = (Column(name, False) for name in ("model", "task", "scorer"))
    columns = (*names, *map(Column, (*CLUE_COLUMNS, "95 %", OPEN_ENDED, ABSENCE)))
    return [Table(title, columns, tuple(rows), (note,))]


def _gain_cells(gain: Gain) -> tuple[str, ...]:
    by_clues = [_points(gain.in_column(name)) for name in CLUE_COLUMNS[:-1]]
    apart = [_points(gain.in_column(name)) for name in (OPEN_ENDED, ABSENCE)]
    total = gain.total()
    mean = "-" if total is None else answered_cell(_points(total.mean), total.n, gain.n_all)
    low, high = (None, None) if total is None else _in_percent(total)
    return *by_clues, mean, interval_cell(low, high, "+.2f"), *apart


def _points(gain: float | None) -> str:
    return "-" if gain is None else f"{100 * gain:+.2f}"


def control_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of the runs that have their control beside them, if there are any."""
    groups = [group for group in _alike_but_for_frames(runs) if _has_difference(group)]
    found = [(group, task) for group in groups for task in _tasks(group)]
    if not found:
        return []
    with_pairs = any(
        run.summary.tasks[task].pairs for group, task in found for run in group.values()
    )
    columns = (
        *(Column(name, False) for name in ("model", "task", "context")),
        *map(Column, _FRAMES),
        *(Column(f"net pairs, {name}") for name in _FRAMES if with_pairs),
        *map(Column, ("of which memory", "knowledge of homes", "n")),
    )
    rows = tuple(Row(tuple(_control_cells(group, task, with_pairs))) for group, task in found)
    on_clues = any(row.cells[2] == "clues" for row in rows)
    notes = (
        *_OF_CONTROLS,
        *((_ON_CLUES,) if on_clues else ()),
        *((_PAIRS,) if with_pairs else ()),
    )
    return [Table("Controls: memory of this home, and knowledge of homes", columns, rows, notes)]


def without_alike_notes(runs: Sequence[RunSummary]) -> list[str]:
    """Return what the other home was not: of the same kind of room, where there is no other."""
    names = {
        traj_id
        for run in runs
        for task in run.header.config.tasks.values()
        for traj_id in task.without_alike
    }
    if not names:
        return []
    return [
        f"other: {', '.join(sorted(names))}: the set has no other home of this kind of room, so "
        "one of another kind was shown."
    ]


def _has_difference(group: _Controls) -> bool:
    return any(first in group and second in group for first, second in _DIFFERENCES)


def _tasks(group: _Controls) -> Iterator[str]:
    run = next(iter(group.values()))
    return (name for name, task in run.summary.tasks.items() if task.n)


def _control_cells(group: _Controls, task: str, with_pairs: bool) -> Iterator[str]:
    tasks: Mapping[str, TaskSummary] = {
        frames: run.summary.tasks[task] for frames, run in group.items()
    }
    first = next(iter(tasks.values()))
    metric = main_metric(first)
    yield next(iter(group.values())).header.name
    yield task
    yield first.context
    for frames in _FRAMES:
        yield mean_cell(tasks[frames].total if frames in tasks else None, metric, 1)
    for frames in _FRAMES if with_pairs else ():
        pairs = tasks[frames].pairs if frames in tasks else None
        yield format_percent(pairs.net_pairs if pairs else None)
    for frames, without in _DIFFERENCES:
        is_known = frames in group and without in group
        yield gain_cell(
            Gain(group[frames], task, metric, tasks[frames], tasks[without]) if is_known else None
        )
    yield str(first.n)
