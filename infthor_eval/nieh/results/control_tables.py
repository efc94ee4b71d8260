"""The table of controls: what of a score is memory of this home, and what knowledge of homes.

Both are defined in docs/reference/metrics.md.
"""

from collections.abc import Iterator, Mapping, Sequence

from infthor_eval.nieh.options import BLANK, NO_CLUE, OTHER, SHOWN
from infthor_eval.nieh.results.cells import mean_cell
from infthor_eval.nieh.results.gains import Gain, alike_but_for_frames, gain_cell
from infthor_eval.nieh.results.summary import TaskSummary, main_metric
from infthor_eval.rates import format_percent
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table

_FRAMES = (SHOWN, NO_CLUE, OTHER, BLANK)
_DIFFERENCES = ((SHOWN, NO_CLUE), (OTHER, BLANK))  # memory, knowledge
_NOTES = (
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


def control_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of the runs that have their control beside them, if there are any."""
    groups = [group for group in alike_but_for_frames(runs) if _has_difference(group)]
    found = [(group, task) for group in groups for task in _tasks(group)]
    if not found:
        return []
    with_pairs = any(_summary(run, task).pairs for group, task in found for run in group.values())
    columns = (
        *(Column(name, False) for name in ("model", "task", "context")),
        *map(Column, _FRAMES),
        *(Column(f"net pairs, {name}") for name in _FRAMES if with_pairs),
        *map(Column, ("of which memory", "knowledge of homes", "n")),
    )
    rows = tuple(Row(tuple(_cells(group, task, with_pairs))) for group, task in found)
    on_clues = any(row.cells[2] == "clues" for row in rows)
    notes = (*_NOTES, *((_ON_CLUES,) if on_clues else ()), *((_PAIRS,) if with_pairs else ()))
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


def _summary(run: RunSummary, task: str) -> TaskSummary:
    summary: TaskSummary = run.summary.tasks[task]
    return summary


def _cells(group: _Controls, task: str, with_pairs: bool) -> Iterator[str]:
    tasks = {frames: _summary(run, task) for frames, run in group.items()}
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
