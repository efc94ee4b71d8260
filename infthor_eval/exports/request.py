"""What an export is asked for, and what it says when it is written."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

NOT_STATED = "not stated"


@dataclass(frozen=True)
class ExportRequest:
    """A request for an export.

    Attributes:
        out: folder of the export.
        data: folder of the runs' data set; None for the one that each names.
        frames: whether the frames of requests are written too, where the format has a place.
        model_id: the model as `developer/name`; None for what the runs know of it.
        organization: who made the runs.
        relationship: their relation to the model's developer, in the words of Every Eval Ever.
        dataset: the data set as `owner/name` on the hub; None if it is not there.
        source_url: where the runs, or a text on them, can be read; None if nowhere.
    """

    out: Path
    data: Path | None = None
    frames: bool = False
    model_id: str | None = None
    organization: str = NOT_STATED
    relationship: str = "other"
    dataset: str | None = None
    source_url: str | None = None


@dataclass(frozen=True)
class Written:
    """An export that was written.

    Attributes:
        paths: its files.
        no_place: what the format has no place for, in words.
        notes: what is missing, or not whole, a line each.
    """

    paths: Sequence[Path]
    no_place: str
    notes: Sequence[str] = ()
