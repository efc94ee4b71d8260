"""`submission.yaml`: what a submitter says of a submission, beside its runs."""

from datetime import date
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.yaml_files import read_yaml

STATEMENT = "submission.yaml"

_Text = Annotated[str, Meta(max_length=300)]
_NOT_EMPTY = Annotated[str, Meta(min_length=1, max_length=300)]
_HINT = "write the fields that docs/submit.md lists"


class Statement(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who was evaluated, and by whom.

    Attributes:
        model: `developer/name`, as on the hub where it is there.
        revision: commit of the checkpoint, or the dated name of a served model.
        submitted_by: name of a person or a group.
        contact: an address at which they answer.
        date: day of the runs.
        task: task that an export answers; for exports that do not tell it.
        engine: library or server that ran the model; for exports, which do not tell it.
        url: where more is said.
        notes: anything else.
    """

    model: _NOT_EMPTY
    revision: _Text = ""
    submitted_by: _Text = ""
    contact: _Text = ""
    date: date
    task: _Text = ""
    engine: _Text = ""
    url: _Text = ""
    notes: Annotated[str, Meta(max_length=2000)] = ""


def read_statement(folder: Path) -> Statement:
    """Read what a submitter says of the submission in a folder."""
    path = folder / STATEMENT
    if not path.is_file():
        raise DataError(f"{path}: no such file; {_HINT}")
    content = read_yaml(path, _HINT)
    with wrap_errors(f"{path}: not a statement", _HINT, catch=msgspec.ValidationError):
        return msgspec.convert(content, Statement)


def find_submissions(folder: Path) -> list[Path]:
    """Return the folders of submissions: the folder itself, else those in it."""
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder; give the folder of a submission, or of several")
    if (folder / STATEMENT).is_file():
        return [folder]
    with wrap_errors(f"{folder}: cannot be searched", "make it readable"):
        # A folder without a statement is one that somebody sent: it is refused, not passed over.
        below = sorted(path for path in folder.iterdir() if path.is_dir())
    found = [path for path in below if not path.name.startswith(".")]
    if not found:
        raise DataError(f"{folder}: no {STATEMENT} in it, and no folder; {_HINT}")
    return found
