"""The paper's Table 4 from the published questions: means of columns `match1` to `match4`."""

from collections import Counter
from collections.abc import Sequence

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.published import PublishedRow, PublishedTable, published_tables
from infthor_eval.formats.question import Question
from infthor_eval.nieh.results.summary import CLUE_COLUMNS
from infthor_eval.statistics import MeanEstimate, clustered_mean
from infthor_eval.tables import Column, Row, Table, TableCell, interval_cell

_TITLE = "Table 4"
_NOTES = (
    "Columns count clue frames: 1 is the whole file of a single clue, 2 and >=3 are the file of "
    "several. The total has all questions, also those of the second file with one clue frame.",
    "95 %: interval of the total, clustered by trajectory.",
)


def table4(data: NiehSet) -> Table:
    """Return Table 4 as the set's own scores give it, each row above the printed one."""
    published = next(table for table in published_tables("nieh") if table.title == _TITLE)
    rows = []
    misprints = []
    for row in published.rows:
        cells = derive_row(data, row)
        low, high = (
            None if end is None else 100 * end for end in (cells["total"].low, cells["total"].high)
        )
        means = [_mean_cell(cells[name]) for name in CLUE_COLUMNS]
        rows.append(
            Row(
                (
                    row.name,
                    f"the set's {row.match}",
                    *means,
                    interval_cell(low, high, pattern="{}–{}"),
                )
            )
        )
        printed, wrong = _printed(row, published)
        rows.append(Row((row.name, "printed", *printed), is_published=True, ends_section=True))
        misprints += wrong
    rows.append(Row(("questions by number of steps", "gt_steps", *_by_steps(data))))
    columns = (Column("model", False), Column("from", False), *map(Column, (*CLUE_COLUMNS, "95 %")))
    return Table(
        "Table 4: accuracy on clue frames, % by number of clues (questions)",
        columns,
        tuple(rows),
        (*_NOTES, *misprints),
    )


def derive_row(data: NiehSet, row: PublishedRow) -> dict[str, MeanEstimate]:
    """Return a row's mean scores by column, from 0 to 1 (the published scorer can exceed 1)."""
    chosen: dict[str, list[Question]] = {name: [] for name in CLUE_COLUMNS}
    for question in data.questions:
        if question.clue_column in chosen:
            chosen[question.clue_column].append(question)
    chosen["total"] = list(data.questions)
    empty = next((name for name, questions in chosen.items() if not questions), None)
    if empty is not None:
        raise DataError(
            f"{data.root}: no question for the column {empty}; give a folder with both published "
            "question files"
        )
    return {name: _mean(questions, row.match or "", data) for name, questions in chosen.items()}


def _by_steps(data: NiehSet) -> list[str]:
    """Return each column's questions by the steps of their clue frames ("2: 215, 3: 7")."""
    cells = []
    for name in CLUE_COLUMNS[:-1]:
        chosen = [
            question.published
            for question in data.questions
            if question.clue_column == name and question.published
        ]
        counts = Counter(len(set(published.steps)) for published in chosen)
        cells.append(", ".join(f"{n_steps}: {count}" for n_steps, count in sorted(counts.items())))
    return cells


def _mean(questions: Sequence[Question], match: str, data: NiehSet) -> MeanEstimate:
    scores = [
        dict(question.published.matches).get(match) if question.published else None
        for question in questions
    ]
    known = [score for score in scores if score is not None]
    if len(known) < len(scores):
        missing = questions[scores.index(None)].id
        raise DataError(
            f"{data.root}: no {match} for question {missing}; give the published question files, "
            "with all columns"
        )
    return clustered_mean(known, [question.traj_id for question in questions])


def _mean_cell(estimate: MeanEstimate) -> TableCell:
    mean = f"{100 * estimate.mean:.2f}"
    return TableCell(f"{mean} ({estimate.n})", {"": mean, "questions": str(estimate.n)})


def _printed(row: PublishedRow, table: PublishedTable) -> tuple[list[str], list[str]]:
    """Return the printed cells, a mark at those known to be wrong, and a note on each of these."""
    values = dict(zip(table.columns, row.values, strict=True))
    cells = [f"{values[name]:.2f}{'*' if name in row.misprints else ''}" for name in CLUE_COLUMNS]
    notes = [
        f"*: {row.name}, column {name}: the paper prints {values[name]:.2f} for {right:.2f}; two "
        "digits are swapped."
        for name, right in row.misprints.items()
    ]
    return cells, notes
