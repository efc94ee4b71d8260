"""`dataset_kwargs` of task files, for suites that describe them by a dataclass."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from infthor_eval.errors import DataError
from infthor_eval.runs.catalog import TaskFile
from infthor_eval.settings import check_names, read, settings_of

T = TypeVar("T", bound=Any)


def task_settings(file: TaskFile, kind: type[T]) -> T:
    """Return the settings of a task file.

    Args:
        kind: dataclass of all settings, with defaults.
    """
    raw = file.settings["dataset_kwargs"]
    if not isinstance(raw, Mapping):
        raise DataError(f"{file.path}: dataset_kwargs must be a mapping of settings")
    location = f"{file.path}: dataset_kwargs"
    check_names(kind, raw, location)
    return read(kind, raw, location)


def with_options(settings: T, options: Any) -> T:
    """Return settings with those options that are settings too, where they are given."""
    shared = settings_of(type(options)).keys() & settings_of(type(settings)).keys()
    given = {name: value for name in shared if (value := getattr(options, name)) is not None}
    return replace(settings, **given)
