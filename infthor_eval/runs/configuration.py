"""How a run was asked for: the options of its command, in a file beside its results with which it can be repeated."""

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.files import write_atomically
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.runs.request import RunRequest

__all__ = ["Configuration", "read_configuration", "read_options", "write_configuration"]

_FILE = "run.yaml"
_HEAD = "# How this run was asked for: `infthor-eval run --config` with this file goes on with it, or repeats it.\n"
_REPEATED = {"include_path"}  # options that are typed once for each of their values
_CHECKPOINT = "pretrained"  # the model option that may name a folder
_MEND = "write options of `infthor-eval run` by their long names, as `limit: 100`"


@dataclass(frozen=True)
class Configuration:
    """How a run was asked for.

    Attributes:
        path: of the file.
        options: of `infthor-eval run`, by their long names with `_` for `-`; several values are a list, those of
            `model_args` a mapping.
    """

    path: Path
    options: Mapping[str, Any]

    @property
    def data(self) -> Path | None:
        """Folder of the data set that was asked about; None where the tasks bring their own, or it was fetched."""
        return Path(self.options["data"]) if self.options.get("data") else None

    @property
    def command(self) -> str:
        """One line for a shell that repeats the run, or goes on with it."""
        typed = [word for name, value in self.options.items() for word in _words(name, value)]
        if any("," in value for value in dict(self.options.get("model_args") or {}).values()):
            typed = ["--config", str(self.path)]  # such a value cannot be typed
        return shlex.join(["infthor-eval", "run", *typed])


def write_configuration(folder: Path, request: RunRequest) -> None:
    """Write how a run was asked for into its folder.

    Args:
        folder: the run's.
        request: what was asked.

    Raises:
        DataError: it cannot be written.
    """
    path = folder / _FILE
    text = _HEAD + yaml.safe_dump(_options_of(request), sort_keys=False, allow_unicode=True)
    with (
        wrap_errors(
            f"{path}: cannot be written", "make room and run the same command again, which goes on where it was"
        ),
        write_atomically(path) as partial,
    ):
        partial.write_text(text, encoding="utf-8")


def read_configuration(run_folder: Path) -> Configuration | None:
    """How the run in a folder was asked for; None where an earlier version made it, which did not write that down.

    Raises:
        DataError: the file is not what it should be.
    """
    path = run_folder.absolute() / _FILE
    return Configuration(path, read_options(path)) if path.is_file() else None


def read_options(path: Path) -> dict[str, Any]:
    """The options that a file of a run holds, as they are written there; their names are not looked at.

    Raises:
        DataError: it cannot be read, or holds no mapping of names.
    """
    found = read_yaml(path, _MEND)
    if not isinstance(found, dict) or not all(isinstance(name, str) for name in found):
        raise DataError(f"{path}: holds no options; {_MEND}")
    if not isinstance(found.get("model_args") or {}, dict | str):
        raise DataError(f"{path}: model_args is neither a mapping nor a text; write K: V below it, a line each")
    return found


def _options_of(request: RunRequest) -> dict[str, Any]:
    """All options that say which run it is and how it is done, and no key: those come from the environment alone."""
    tasks, given = request.tasks, dict(request.model_options)
    if _CHECKPOINT in given:
        given[_CHECKPOINT] = _place(given[_CHECKPOINT])
    every = {
        "model": request.model,
        "model_args": given or None,
        "tasks": list(request.asked),
        "include_path": [str(folder.absolute()) for folder in request.include] or None,
        "data": None if tasks.data is None else str(tasks.data.absolute()),
        "limit": tasks.limit,
        "seed": tasks.seed,
        "name": request.name,
        "output": str(request.output.absolute()),
        **_unlike_default(tasks.options),
        **_unlike_default(request.worker_settings),
    }
    return {name: value for name, value in every.items() if value is not None}


def _unlike_default(options: Any) -> dict[str, Any]:
    """The options of a suite, or of the worker_settings, that were told otherwise than they are by themselves."""
    if not is_dataclass(options):  # a suite without any
        return {}
    told = [(item, getattr(options, item.name)) for item in fields(options)]
    return {
        item.name: _place(value) if item.metadata.get("is_place") else value
        for item, value in told
        if value != item.default
    }


def _place(text: str) -> str:
    """A place as it is found from any folder; a name of the hub as it is."""
    return str(Path(text).absolute()) if Path(text).exists() else text


def _words(name: str, value: Any) -> Iterator[str]:
    """An option as it is typed."""
    if value is None or value is False:
        return
    typed = f"--{name.replace('_', '-')}"
    if name in _REPEATED:
        yield from (word for one in value for word in (typed, str(one)))
        return
    yield typed
    if isinstance(value, Mapping):
        yield ",".join(f"{key}={item}" for key, item in value.items())
    elif isinstance(value, list):
        yield ",".join(map(str, value))
    elif value is not True:
        yield str(value)
