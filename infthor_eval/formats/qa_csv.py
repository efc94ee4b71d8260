"""Question files: `qa_set*.csv` of an NIEH set.

Columns `traj_id`, `question`, `gt_img_idx`, `answer`; the last two are Python-literal lists (`[12,
13]`, `['yes']`). `question_type` and `absence` are ours and optional. `absence` is `yes` for
questions whose answer is that something is nowhere: no frame is evidence for that, and `gt_img_idx`
is a sample. Without a `question_type` the tables take the type that the question's words have in
Table 3 (`question_forms`). `pair` and `fact` are there in sets of twins alone: both questions of a
pair have the same `pair`, and all on one changed fact the same `fact`. `moment` is the number of
the frame after which a question is asked; nothing there is the trajectory's end.

The two published files (`qa_set_nieh_single_clue.csv`, `qa_set_nsieh_multi_clue.csv`) have `qid`,
`num_evidence`, `gt_steps` and `match1` to `match4` too, which are kept; copies without some of them
can be read. Other columns are ignored.
"""

import ast
import csv
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.csv_files import CsvRow, read_rows, shield, unshield
from infthor_eval.formats.question import PublishedColumns, Question, SkippedQuestion
from infthor_eval.formats.reading import is_encodable
from infthor_eval.storage.files import write_atomically

_COLUMNS = ("traj_id", "question", "gt_img_idx", "answer")
_TYPE = "question_type"
_ABSENCE = "absence"
_MOMENT = "moment"
_TWINS = ("pair", "fact")
_MATCHES = ("match1", "match2", "match3", "match4")
_PUBLISHED = ("qid", "num_evidence", "gt_steps", *_MATCHES)
_CLUE_FILES = ("single", "multi")  # in the names of the published files, before "_clue"
_LARGEST = 2**63  # JSON readers refuse larger numbers


def read_questions(path: Path) -> list[Question | SkippedQuestion]:
    """Read a question file; a row with a malformed cell is a `SkippedQuestion` that names its
    line."""
    hint = (
        f"a question file is a UTF-8 CSV file with the columns {', '.join(_COLUMNS)}, or question "
        "and answer beside frames of your own"
    )
    file = next((name for name in _CLUE_FILES if f"{name}_clue" in path.stem), None)
    entries = [_question_or_reason(row, path, file) for row in read_rows(path, _COLUMNS, hint)]
    if entries and not any(isinstance(entry, Question) for entry in entries):
        reason = next(entry.reason for entry in entries if isinstance(entry, SkippedQuestion))
        raise DataError(f"{path}: no row is a question ({reason})")
    return entries


def write_questions(path: Path, questions: Iterable[Question]) -> None:
    """Write a question file, atomically."""
    with write_atomically(path) as partial:
        partial.write_bytes(encode_questions(questions))


def encode_questions(questions: Iterable[Question]) -> bytes:
    """Return the content of a question file."""
    questions = list(questions)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    are_published = any(question.published for question in questions)
    are_twins = any(question.pair for question in questions)
    have_moments = any(question.moment is not None for question in questions)
    further = (
        *((_MOMENT,) if have_moments else ()),
        *(_TWINS if are_twins else ()),
        *(_PUBLISHED if are_published else ()),
    )
    writer.writerow([*_COLUMNS, _TYPE, _ABSENCE, *further])
    for question in questions:
        absence = "yes" if question.absence else ""
        cells = [
            question.traj_id,
            question.text,
            list(question.clues),
            list(question.answers),
            question.question_type or "",
            absence,
        ]
        moment = "" if question.moment is None else question.moment
        moments = (moment,) if have_moments else ()
        twins = (question.pair, question.fact) if are_twins else ()
        published = _published_cells(question.published) if question.published else ()
        writer.writerow([shield(str(cell)) for cell in (*cells, *moments, *twins, *published)])
    return text.getvalue().encode()


def _question_or_reason(row: CsvRow, path: Path, file: str | None) -> Question | SkippedQuestion:
    # The file's name alone, without its folder: reasons are in a run's identity.
    location = f"{path.name}, line {row.line}"
    cells = {name: unshield(cell) for name, cell in row.cells.items()}
    try:
        if row.problem is not None:
            raise DataError(row.problem)
        return _question(cells, file)
    except DataError as error:
        incomplete = Question(cells["traj_id"].strip(), cells["question"].strip(), (), ())
        return SkippedQuestion(incomplete, f"{location}: {error}")


# Messages say nothing of a cell's content, so that rows with one mistake are counted together.
def _question(row: dict[str, str], file: str | None) -> Question:
    for name in _COLUMNS:
        if not row[name].strip():
            raise DataError(f"{name} is empty; fill it or remove the row")
    absence = row.get(_ABSENCE, "").strip().lower()
    if absence not in {"", "yes", "no"}:
        raise DataError(f"{_ABSENCE} is neither yes nor no; write one of them, or nothing")
    clues = _literal_list(row, "gt_img_idx", int)
    answers = _literal_list(row, "answer", (str, int, float))
    if not all(map(_is_answerable, answers)):
        raise DataError("answer has an entry that no reply can match; write it out")
    return Question(
        traj_id=row["traj_id"].strip(),
        text=row["question"].strip(),
        clues=tuple(clues),
        answers=tuple(answers),
        question_type=row.get(_TYPE, "").strip() or None,
        absence=absence == "yes",
        moment=_moment(row.get(_MOMENT, "").strip()),
        published=_published(row, file),
        pair=row.get("pair", "").strip(),
        fact=row.get("fact", "").strip(),
    )


def _moment(cell: str) -> int | None:
    if cell and not (cell.isascii() and cell.isdigit()):
        raise DataError(f"{_MOMENT} is not the number of a frame; write it, or nothing")
    return int(cell) if cell else None


def _published(row: dict[str, str], file: Any) -> PublishedColumns | None:
    if file is None:
        return None
    cells = {
        name: cell.strip() for name, cell in row.items() if name in _PUBLISHED and cell.strip()
    }
    try:
        n_evidence = int(cells["num_evidence"]) if "num_evidence" in cells else None
        matches = tuple((name, float(cells[name])) for name in _MATCHES if name in cells)
    except ValueError:
        raise DataError("num_evidence or one of match1 to match4 is not a number; fix it") from None
    if not all(math.isfinite(score) for _, score in matches):
        raise DataError("one of match1 to match4 is not finite; fix it")
    steps = _literal_list({"gt_steps": "[]"} | cells, "gt_steps", int)
    return PublishedColumns(file, cells.get("qid"), n_evidence, tuple(steps), matches)


def _published_cells(published: PublishedColumns) -> list[object]:
    matches = dict(published.matches)
    n_evidence = "" if published.n_evidence is None else published.n_evidence
    return [
        published.qid or "",
        n_evidence,
        list(published.steps),
        *(matches.get(name, "") for name in _MATCHES),
    ]


def _literal_list(row: dict[str, str], name: str, types: type | tuple[type, ...]) -> list[Any]:
    try:
        value = ast.literal_eval(row[name].strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        value = None
    if not isinstance(value, list):
        raise DataError(f"{name} is not a list; write it as in [12, 13] or ['yes']")
    if not all(isinstance(element, types) and not isinstance(element, bool) for element in value):
        raise DataError(
            f"{name} has an entry of the wrong type; write it as in [12, 13] or ['yes']"
        )
    return value


def _is_answerable(answer: str | int | float) -> bool:
    """Return True for a text that is not blank, or a number that JSON can hold."""
    if not isinstance(answer, str):
        return math.isfinite(answer) and abs(answer) < _LARGEST
    return bool(answer.strip()) and is_encodable(answer)
