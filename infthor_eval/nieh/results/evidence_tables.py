"""Tables on the evidence: how much was shown, how far from the end, and scores above blind."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from infthor_eval.distances import DISTANCES
from infthor_eval.nieh.results.above_blind import SOLVED, AboveBlind
from infthor_eval.nieh.results.cells import Cell, mean_cell, score_interval
from infthor_eval.nieh.results.gains import name_of
from infthor_eval.nieh.results.summary import (
    SHOWN_CLUES,
    EvidenceCells,
    NiehSummary,
    TaskSummary,
)
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, TableCell

_ALONE = "above blind: not given, as beside one trajectory there is no other to learn from."
_WITH_INTERVAL = "In brackets: 95 % interval, clustered by trajectory; in parentheses: questions."


def evidence_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the tables by share of the clue frames shown and last clue's distance, where known.

    A task that shows all evidence of all samples is not in the first, which would say nothing of
    it.
    """
    distances = _used(runs)
    rows = list(_rows(runs, lambda cells: cells.by_shown_clues, SHOWN_CLUES, _hides_evidence))
    far = list(
        _rows(
            runs, lambda cells: cells.by_distance, distances, lambda task: task.context != "clues"
        )
    )
    tables = []
    if rows:
        title = "Accuracy, % by how many of the clue frames were shown (questions)"
        tables.append(_table(title, SHOWN_CLUES, rows))
    if far:
        title = (
            "Accuracy, % by frames between the last clue and the end of the trajectory (questions)"
        )
        tables.append(_table(title, distances, far))
    return tables


def short_name(file: str) -> str:
    """Return the name of a question file in tables."""
    return file.removeprefix("qa_set_")


def above_blind_cell(above: AboveBlind | None) -> TableCell:
    """Return the score above blind in percent, with its interval; `-` if there is none."""
    if above is None or above.mean is None:
        return _score_cell(None, None, None)
    return _score_cell(above.mean, above.low, above.high)


def above_blind_notes(runs: Sequence[RunSummary]) -> list[str]:
    """Return what the column says, and what it leaves out."""
    scores = [score for _, _, task in _tasks(runs) for score in task.above_blind.values()]
    if not any(score.n for score in scores):
        is_alone = any(len(of) == 1 for *_, task in _tasks(runs) for of in task.scores.values())
        is_unknown = any(score.n_unknown for score in scores)
        return [_ALONE] if is_alone and is_unknown else []
    solved = sorted(
        {(score.n_solved, len(score.solved_forms)) for score in scores if score.n_solved}
    )
    counts = "; ".join(f"{n} questions of {n_forms} forms" for n, n_forms in solved)
    left_out = (
        f" Not counted, as blind solves their forms (above {SOLVED:.0%}): {counts}."
        if solved
        else ""
    )
    return [
        "above blind: % of what the baseline blind has not that was got, 0 for blind and 100 "
        f"for all right, with its interval over resampled trajectories.{left_out}"
    ]


def _tasks(runs: Sequence[RunSummary]) -> Iterator[tuple[str, str, TaskSummary]]:
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        yield from ((name_of(run), name, task) for name, task in run.summary.tasks.items())


def _hides_evidence(task: TaskSummary) -> bool:
    return bool(task.evidence["total"].by_shown_clues.keys() - {"all"})


def _used(runs: Sequence[RunSummary]) -> list[str]:
    used = {name for _, _, task in _tasks(runs) for name in task.evidence["total"].by_distance}
    return [name for name in DISTANCES if name in used]


def _rows(
    runs: Sequence[RunSummary],
    cells_of: Callable[[EvidenceCells], Mapping[str, Cell]],
    names: Sequence[str],
    is_worth: Callable[[TaskSummary], bool],
) -> Iterator[Row]:
    """Yield a row per task, file and metric, of tasks that have such cells and are worth it."""
    for run, name, task in _tasks(runs):
        if not cells_of(task.evidence["total"]) or not is_worth(task):
            continue
        for file, evidence in task.evidence.items():
            cells = cells_of(evidence)
            for metric in task.metrics:
                yield Row(
                    (
                        run,
                        name,
                        file.removeprefix("qa_set_"),
                        metric,
                        *(_cell(cells.get(column), metric) for column in names),
                    )
                )


def _cell(cell: Cell | None, metric: str) -> TableCell:
    """Return a mean with its interval and its questions."""
    if cell is None:
        missing = _score_cell(None, None, None)
        return TableCell(missing, {**missing.numbers, "questions": ""})
    mean = mean_cell(cell, metric, 1)
    interval = score_interval(cell, metric)
    text = f"{mean} {interval}" if interval.numbers["low"] else mean
    numbers = {"": "", **interval.numbers, **mean.numbers, "questions": str(cell.n)}
    return TableCell(f"{text} ({cell.n})", numbers)


def _score_cell(mean: float | None, low: float | None, high: float | None) -> TableCell:
    """Return a share in percent with its interval, as far as there are any."""
    if mean is None:
        return TableCell("-", {"": "", "low": "", "high": ""})
    ends = ["" if end is None else f"{100 * end:.1f}" for end in (low, high)]
    interval = f" [{ends[0]}, {ends[1]}]" if all(ends) else ""
    numbers = {"": f"{100 * mean:.1f}", "low": ends[0], "high": ends[1]}
    return TableCell(f"{numbers['']}{interval}", numbers)


def _table(title: str, names: Sequence[str], rows: Sequence[Row]) -> Table:
    heads = [Column(name, False) for name in ("model", "task", "file", "scorer")]
    return Table(title, (*heads, *map(Column, names)), tuple(rows), (_WITH_INTERVAL,))
