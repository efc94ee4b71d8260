"""The table of memories: what each got right, what it recalled of the evidence, what that took."""

from collections.abc import Iterator, Sequence

from infthor_eval.nieh.results.cells import mean_cell
from infthor_eval.nieh.results.gains import name_of
from infthor_eval.nieh.results.memory_summary import subject_of
from infthor_eval.nieh.results.summary import SHOWN_CLUES, NiehSummary, TaskSummary, main_metric
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, TableCell, interval_cell

__all__ = ["memory_tables"]

_NAMES = ("model", "task", "memory")
_NUMBERS = (
    "budget",
    "accuracy",
    "95 %",
    "above guessing",
    "all clues",
    "some",
    "none",
    "frames",
    "tokens",
    "build s",
    "recall s",
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
    """Return the table of the tasks that have a memory, if there are any."""
    rows = tuple(row for _, row in sorted(_rows(runs), key=lambda keyed: keyed[0]))
    columns = (*(Column(name, False) for name in _NAMES), *map(Column, _NUMBERS))
    return [Table("Memories", columns, rows, _NOTES)] if rows else []


def _rows(runs: Sequence[RunSummary]) -> Iterator[tuple[tuple[str | int, ...], Row]]:
    """Yield rows with their place: by subject and task, a memory's budgets below each other."""
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        for name, task in run.summary.tasks.items():
            if task.memory is not None:
                subject = subject_of(name_of(run))
                sort_key = subject, name, task.memory.name, task.memory.budget or 0
                yield sort_key, Row((subject, name, *_cells(run.summary, name, task)))


def _cells(summary: NiehSummary, name: str, task: TaskSummary) -> tuple[str, ...]:
    memory = task.memory
    times = summary.took.get(name)
    metric = main_metric(task)
    assert memory is not None
    score = task.total.scores.get(metric)
    low, high = (None, None) if score is None else (score.low, score.high)
    above = task.above_guessing.get(metric)
    return (
        f"{memory.name}{'*' if memory.privileged else ''}",
        "-" if memory.budget is None else f"{memory.budget:,}",
        mean_cell(task.total, metric, 1),
        interval_cell(
            *(None if end is None else 100 * end for end in (low, high)), pattern="{}–{}"
        ),
        "-" if above is None or above.mean is None else f"{100 * above.mean:.1f}",
        *(_recalled(task, share, metric) for share in SHOWN_CLUES),
        f"{memory.n_frames:.1f}",
        "-" if memory.n_tokens is None else f"{memory.n_tokens:,.0f}",
        "-" if times is None else f"{times.build_s:.3f}",
        "-" if times is None else f"{times.recall_s:.3f}",
    )


def _recalled(task: TaskSummary, share: str, metric: str) -> TableCell:
    cells = task.evidence["total"].by_shown_clues
    n_all = sum(cell.n for cell in cells.values())
    if share not in cells:
        return TableCell("-", {"": "", "questions": "0"})
    cell = cells[share]
    mean = mean_cell(cell, metric, 1)
    part = f"{100 * cell.n / n_all:.0f}"
    return TableCell(f"{mean} ({part} %)", {**mean.numbers, "questions": str(cell.n)})
