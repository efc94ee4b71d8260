"""What `dataset_kwargs` of a task file can say, for suites that have a dataclass of it."""

import difflib
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_type_hints

from infthor_eval.errors import DataError
from infthor_eval.runs.catalog import TaskFile

__all__ = ["task_settings"]

T = TypeVar("T")
_FORMS: dict[type, str] = {
    bool: "true or false",
    int: "a whole number above 0",
    float: "a number above 0",
    str: "a text",
}


def task_settings(
    file: TaskFile, kind: type[T], told: Mapping[str, Any], choices: Mapping[str, Sequence[str]] | None = None
) -> T:
    """The settings of a task, with what the command line tells instead.

    Args:
        file: the task.
        kind: dataclass of all settings, with defaults; numbers are above 0, and a text may be optional.
        told: by name what the run was told beside the file; None for nothing.
        choices: by name the texts that a setting can be.

    Raises:
        DataError: a setting that would not act, or not as it was meant.
    """
    given = file.settings["dataset_kwargs"]
    if not isinstance(given, Mapping):
        raise DataError(f"{file.path}: dataset_kwargs must be a mapping of settings")
    hints = get_type_hints(kind)
    for key, value in given.items():
        where = f"{file.path}: dataset_kwargs: {key}"
        if key not in hints:
            near = difflib.get_close_matches(str(key), hints, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(hints)}"
            raise DataError(f"{where} is not known; {hint}")
        wanted = hints[key] if hints[key] in _FORMS else str
        if not _fits(value, wanted):
            raise DataError(f"{where} is {value!r:.60}; it is {_FORMS[wanted]}")
        allowed = (choices or {}).get(str(key), (value,))
        if value not in allowed:
            raise DataError(f"{where} is {value!r:.60}; there are {', '.join(allowed)}")
    return kind(**{**given, **{name: value for name, value in told.items() if value is not None}})


def _fits(value: object, wanted: type) -> bool:
    if wanted is bool or isinstance(value, bool):
        return wanted is bool and isinstance(value, bool)
    if wanted is str:
        return isinstance(value, str)
    whole = isinstance(value, int)
    return (whole if wanted is int else whole or isinstance(value, float)) and math.isfinite(value) and value > 0  # type: ignore[arg-type,operator]
