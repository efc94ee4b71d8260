"""The table of memories: what each got right, what it recalled of the evidence, what that took."""

from collections.abc import Sequence
from operator import itemgetter

from msgspec.structs import replace

from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.results.cells import mean_cell, percent, score_interval
from infthor_eval.nieh.results.facets import SHOWN_CLUES
from infthor_eval.nieh.results.gains import Gain, difference_cell, gain_cell, paired_gain
from infthor_eval.nieh.results.memory_summary import KeptMeans, subject_of
from infthor_eval.nieh.results.summary import NiehSummary, TaskSummary, main_metric
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, TableCell

_NAMES = ("model", "task", "memory")
_NUMBERS = (
    "budget",
    "accuracy",
    "95 %",
    "all clues",
    "some",
    "none",
    "frames",
    "tokens",
    "build s",
    "recall s",
)
_KEPT_NOTE = (
    "kept, MB: tokens and bytes that are left of the model's cache of the frames before the "
    "current view; clues kept: % of the clue frames' tokens among them, the mean of layers and "
    "heads."
)
_KEPT = ("kept", "MB", "clues kept")
_NONE = "none"  # the memory that recalls nothing
_ABOVE_NONE = "above none"
_ABOVE_BLIND = "above blind"
_PAIRS_ABOVE_NONE = "pairs above none"
_FIRST = 3  # numbers before those three
_ABOVE_NONE_NOTE = (
    "above none: accuracy less that of the run that recalls nothing, in points, paired by "
    "question, with the 95 % interval clustered by trajectory; pairs above none: likewise of pairs "
    "of twins."
)
_NOTES = (
    "Accuracy in %, by the main scorer. all clues, some, none: accuracy where all, some and none "
    "of the clue frames were recalled or are the current view; in parentheses: % of the questions "
    "that have evidence.",
    "frames, tokens: of a question on average, the current view's tokens included. build s: "
    "seconds to observe a trajectory; recall s: to recall for a question, notes that the model "
    "writes included.",
    "* is given what no agent can know: the simulator's metadata, and the oracle the clues.",
)


def memory_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of the tasks that have a memory, if there are any.

    It compares with no memory, and with `blind`, where a run has none and that is known.
    """
    found = [
        (run, name)
        for run in runs
        for name, task in run.summary.tasks.items()
        if task.memory is not None
    ]
    is_above_none = any(_is_none(run, name) for run, name in found)
    has_pairs = any(run.summary.tasks[name].pairs is not None for run, name in found)
    wanted = {
        _PAIRS_ABOVE_NONE: has_pairs and is_above_none,
        _ABOVE_NONE: is_above_none,
        _ABOVE_BLIND: any(_above_blind(run, name) for run, name in found),
    }
    further = [column for column, is_wanted in wanted.items() if is_wanted]
    keyed = sorted(((_place(*it), _row(*it, runs, further)) for it in found), key=itemgetter(0))
    names = (*_NUMBERS[:_FIRST], *further, *_NUMBERS[_FIRST:])
    has_kept = any(run.summary.tasks[name].memory.kept is not None for run, name in found)
    names = (*names, *(_KEPT if has_kept else ()))
    columns = (*(Column(name, False) for name in _NAMES), *map(Column, names))
    notes = (*_NOTES, *((_ABOVE_NONE_NOTE,) if _ABOVE_NONE in further else ()))
    notes = (*notes, *((_KEPT_NOTE,) if has_kept else ()))
    return [Table("Memories", columns, tuple(row for _, row in keyed), notes)] if found else []


def _place(run: RunSummary, name: str) -> tuple[str, str, bool, str, int]:
    """Return the place of a row: by subject and task, none first, a memory's budgets in order."""
    memory = run.summary.tasks[name].memory
    return subject_of(run.header.label), name, memory.name != _NONE, memory.name, memory.budget or 0


def _row(run: RunSummary, name: str, runs: Sequence[RunSummary], further: Sequence[str]) -> Row:
    cells = _cells(run.summary, name, run.summary.tasks[name], run.header.config)
    made = {
        _PAIRS_ABOVE_NONE: _pairs_above_none,
        _ABOVE_NONE: _above_none,
        _ABOVE_BLIND: _above_blind_cell,
    }
    more = [made[column](run, name, runs) for column in further]
    at = len(_NAMES) - 2 + _FIRST
    return Row((subject_of(run.header.label), name, *cells[:at], *more, *cells[at:]))


def _is_none(run: RunSummary, name: str) -> bool:
    return bool(run.summary.tasks[name].memory.name == _NONE)


def _pairs_above_none(run: RunSummary, name: str, runs: Sequence[RunSummary]) -> TableCell:
    pairs = run.summary.tasks[name].pairs
    none = _with_none(run, name, runs)
    if pairs is None or none is None or none.pairs is None:
        return difference_cell(None, 0)
    return difference_cell(paired_gain(pairs.scores, none.pairs.scores), pairs.n_pairs)


def _above_none(run: RunSummary, name: str, runs: Sequence[RunSummary]) -> TableCell:
    task, none = run.summary.tasks[name], _with_none(run, name, runs)
    return gain_cell(None if none is None else Gain(run, name, main_metric(task), task, none))


def _with_none(run: RunSummary, name: str, runs: Sequence[RunSummary]) -> TaskSummary | None:
    """Return the task of the run that is alike but recalls nothing, if there is one."""
    if _is_none(run, name):
        return None
    alike = (
        other.summary.tasks[name]
        for other in runs
        if name in other.summary.tasks
        and other.summary.tasks[name].memory is not None
        and _is_none(other, name)
        and _without_memory(other, name) == _without_memory(run, name)
    )
    return next(alike, None)


def _without_memory(run: RunSummary, name: str) -> NiehConfig:
    """Return the config of a run of a task, without its memory."""
    config: NiehConfig = run.header.config
    task = config.tasks[name]
    sources = {key: value for key, value in task.sources.items() if key != "memory"}
    options = ("memory", "budget")
    own = {key: value for key, value in task.dataset_kwargs.items() if key not in options}
    settings = task.settings | {"dataset_kwargs": own}
    tasks = {name: replace(task, sources=sources, settings=settings)}
    return replace(config, tasks=tasks, memory=None, memory_args=None, budget=None)


def _above_blind(run: RunSummary, name: str) -> float | None:
    task = run.summary.tasks[name]
    above = task.above_blind.get(main_metric(task))
    return None if above is None else above.mean


def _above_blind_cell(run: RunSummary, name: str, _: Sequence[RunSummary]) -> str:
    return percent(_above_blind(run, name))


def _cells(
    summary: NiehSummary, name: str, task: TaskSummary, config: NiehConfig
) -> tuple[str, ...]:
    memory = task.memory
    times = summary.took.get(name)
    metric = main_metric(task)
    assert memory is not None
    return (
        f"{memory.name}{'*' if memory.privileged else ''}",
        "-" if memory.budget is None else f"{memory.budget:,}{config.in_frames(memory.budget)}",
        mean_cell(task.total, metric, 1),
        score_interval(task.total, metric, "{}–{}"),
        *(_recalled(task, share, metric) for share in SHOWN_CLUES),
        f"{memory.n_frames:.1f}",
        "-" if memory.n_tokens is None else f"{memory.n_tokens:,.0f}",
        "-" if times is None else f"{times.build_s:.3f}",
        "-" if times is None else f"{times.recall_s:.3f}",
        *(() if memory.kept is None else _kept_cells(memory.kept)),
    )


def _kept_cells(kept: KeptMeans) -> tuple[str, ...]:
    return f"{kept.tokens:,.0f}", f"{kept.bytes / 1e6:.2f}", percent(kept.clues)


def _recalled(task: TaskSummary, share: str, metric: str) -> TableCell:
    cells = task.by["shown_clues"]
    n_all = sum(cell.n for cell in cells.values())
    if share not in cells:
        return TableCell("-", {"": "", "questions": "0"})
    cell = cells[share]
    mean = mean_cell(cell, metric, 1)
    part = f"{100 * cell.n / n_all:.0f}"
    return TableCell(f"{mean} ({part} %)", {**mean.numbers, "questions": str(cell.n)})
