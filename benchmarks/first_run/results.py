"""Results of steps, kept in files so that a stopped run goes on where it was."""

from pathlib import Path
from typing import Any, Literal

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.storage.files import write_atomically

__all__ = ["StepResult", "read_result", "write_result"]

_FILE = "result.json"


class StepResult(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a step.

    Attributes:
        state: done, failed, or not run.
        text: what was measured, or why not.
        right: whether it is as expected; None where that is for people to see.
        seconds: what it took in all.
        figures: numbers for later steps.
        machine: identity of the machine that it ran on.
    """

    state: Literal["done", "failed", "not run"]
    text: str
    right: bool | None = None
    seconds: float = 0.0
    figures: dict[str, Any] = {}
    machine: dict[str, str | None] = {}


def read_result(folder: Path) -> StepResult | None:
    """Return the result in a step's folder, or None.

    Raises:
        DataError: the file is damaged.
    """
    file = folder / _FILE
    if not file.exists():
        return None
    try:
        return msgspec.json.decode(file.read_bytes(), type=StepResult)
    except msgspec.DecodeError as error:
        raise DataError(f"{file}: {error}; delete it, and the step is done again") from error


def write_result(folder: Path, result: StepResult) -> None:
    """Write a result into a step's folder, whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    with write_atomically(folder / _FILE) as unfinished:
        unfinished.write_bytes(msgspec.json.encode(result))
