"""`dataset_kwargs` of task files, for suites that describe them by a dataclass."""

import difflib
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_type_hints

from infthor_eval.errors import DataError
from infthor_eval.runs.catalog import TaskFile

T = TypeVar("T")
_TYPES: dict[type, str] = {
    bool: "true or false",
    int: "a whole number above 0",
    float: "a number above 0",
    str: "a text",
}


def task_settings(
    file: TaskFile,
    kind: type[T],
    overrides: Mapping[str, Any],
    choices: Mapping[str, Sequence[str]] | None = None,
) -> T:
    """Return the settings of a task file, with those that override them.

    Args:
        kind: dataclass of all settings, with defaults; numbers are above 0, and a text may be
            optional.
        overrides: settings by name that replace the file's; None keeps the file's.
        choices: allowed texts of settings, by name.

    Raises:
        DataError: a setting is unknown, or has a value that is not allowed.
    """
    settings = file.settings["dataset_kwargs"]
    if not isinstance(settings, Mapping):
        raise DataError(f"{file.path}: dataset_kwargs must be a mapping of settings")
    hints = get_type_hints(kind)
    for key, value in settings.items():
        where = f"{file.path}: dataset_kwargs: {key}"
        if key not in hints:
            near = difflib.get_close_matches(str(key), hints, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(hints)}"
            raise DataError(f"{where} is not known; {hint}")
        expected = hints[key] if hints[key] in _TYPES else str
        if not _fits(value, expected):
            raise DataError(f"{where} is {value!r:.60}; it is {_TYPES[expected]}")
        allowed = (choices or {}).get(str(key), (value,))
        if value not in allowed:
            raise DataError(f"{where} is {value!r:.60}; there are {', '.join(allowed)}")
    return kind(
        **{**settings, **{name: value for name, value in overrides.items() if value is not None}}
    )


def _fits(value: object, expected: type) -> bool:
    if isinstance(value, bool):  # which Python counts among the integers
        return expected is bool
    if isinstance(value, int) and expected in (int, float):
        return value > 0
    if isinstance(value, float) and expected is float:
        return math.isfinite(value) and value > 0
    return expected is str and isinstance(value, str)
