"""Tables by facet of questions, and scores above blind as cells."""

from collections.abc import Iterator, Mapping, Sequence

from infthor_eval.facets import facet_table
from infthor_eval.nieh.results.above_blind import SOLVED, AboveBlind
from infthor_eval.nieh.results.cells import Cell, mean_cell, score_interval
from infthor_eval.nieh.results.facets import FACETS, QuestionFacet
from infthor_eval.nieh.results.summary import TaskSummary, named_tasks
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Table, TableCell

_ALONE = "above blind: not given, as beside one trajectory there is no other to learn from."
_WITH_INTERVAL = "In brackets: 95 % interval, clustered by trajectory; in parentheses: questions."


def question_facet_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of each facet that tells anything of a task."""
    return [table for facet in FACETS if facet.in_tables for table in _table(facet, runs)]


def _table(facet: QuestionFacet, runs: Sequence[RunSummary]) -> list[Table]:
    used = {name for *_, task in named_tasks(runs) for name in task.by[facet.name]}
    return facet_table(
        f"Accuracy, % by {facet.title or facet.heading} (questions)",
        ("model", "task", *(("file",) if facet.of_files else ()), "scorer"),
        facet.shown(used),
        list(_rows(facet, runs)),
        lambda scores: _cell(*(scores or (None, ""))),
        (_WITH_INTERVAL,),
    )


def _rows(
    facet: QuestionFacet, runs: Sequence[RunSummary]
) -> Iterator[tuple[tuple[str, ...], dict[str, tuple[Cell, str]]]]:
    """Yield the names and the cells of a row per task, metric, and file if the facet has those."""
    for run, name, task in named_tasks(runs):
        if not facet.is_worth(task.context, task.by[facet.name]):
            continue
        for file, cells in facet_cells(facet, task).items():
            of_file = (short_name(file),) if facet.of_files else ()
            for metric in task.metrics:
                by_class = {key: (cell, metric) for key, cell in cells.items()}
                yield (run, name, *of_file, metric), by_class


def facet_cells(facet: QuestionFacet, task: TaskSummary) -> dict[str, Mapping[str, Cell]]:
    """Return a facet's cells of all questions ("total"), and of each file if it has those."""
    files = task.files if facet.of_files else {}
    return {
        "total": task.by[facet.name],
        **{name: cells[facet.name] for name, cells in files.items()},
    }


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
    scores = [score for _, _, task in named_tasks(runs) for score in task.above_blind.values()]
    if not any(score.n for score in scores):
        is_alone = any(
            len(of) == 1 for *_, task in named_tasks(runs) for of in task.scores.values()
        )
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
