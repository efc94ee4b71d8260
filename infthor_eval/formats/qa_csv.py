"""Question files: `qa_set*.csv` of an NIEH set.

Columns `traj_id`, `question`, `gt_img_idx`, `answer`; the last two are Python-literal lists (`[12, 13]`, `['yes']`).
`question_type` and `absence` (`yes` where the answer is that something is nowhere, so that the frames are a sample and
no evidence) are ours and optional; other columns are left unread.
"""

import ast
import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.files import written_atomically
from infthor_eval.formats.question import Question

__all__ = ["read_questions", "write_questions"]

_COLUMNS = ("traj_id", "question", "gt_img_idx", "answer")
_TYPE = "question_type"
_ABSENCE = "absence"


def read_questions(path: Path) -> list[Question]:
    """Read a question file.

    Raises:
        DataError: the file cannot be read, lacks a column, or a cell is not what the column holds.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [name for name in _COLUMNS if name not in (reader.fieldnames or ())]
            if missing:
                raise DataError(f"{path}: no column {', '.join(missing)}; a question file has {', '.join(_COLUMNS)}")
            return [_question(row, f"{path}, line {reader.line_num}") for row in reader]
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); give a question file") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: not a UTF-8 CSV file ({error})") from error


def write_questions(path: Path, questions: Iterable[Question]) -> None:
    """Write a question file, whole or not at all."""
    with written_atomically(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*_COLUMNS, _TYPE, _ABSENCE])
        for item in questions:
            absence = "yes" if item.absence else ""
            writer.writerow(
                [item.traj_id, item.text, list(item.clues), list(item.answers), item.question_type or "", absence]
            )


def _question(row: dict[str, str | None], place: str) -> Question:
    for name in _COLUMNS:
        if not (row[name] or "").strip():
            raise DataError(f"{place}: {name} is empty; fill it or take the row out")
    absence = (row.get(_ABSENCE) or "").strip().lower()
    if absence not in {"", "yes", "no"}:
        raise DataError(f"{place}: {_ABSENCE} is {_short(absence)}; it is yes, no or empty")
    clues = _literal_list(row["gt_img_idx"], f"{place}: gt_img_idx", int)
    answers = _literal_list(row["answer"], f"{place}: answer", (str, int, float))
    return Question(
        traj_id=(row["traj_id"] or "").strip(),
        text=(row["question"] or "").strip(),
        clues=tuple(clues),
        answers=tuple(answers),
        question_type=(row.get(_TYPE) or "").strip() or None,
        absence=absence == "yes",
    )


def _literal_list(cell: str | None, place: str, types: type | tuple[type, ...]) -> list[Any]:
    try:
        value = ast.literal_eval((cell or "").strip())
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        value = None
    if not isinstance(value, list):
        raise DataError(f"{place} is not a list: {_short(cell)}; write it as in [12, 13] or ['yes']")
    if not all(isinstance(item, types) and not isinstance(item, bool) for item in value):
        raise DataError(f"{place} has an entry of the wrong type: {_short(cell)}")
    return value


def _short(cell: str | None) -> str:
    text = repr(cell or "")
    return text if len(text) <= 60 else text[:57] + "..."
