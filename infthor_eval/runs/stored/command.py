"""The command of a run: its options in `run.yaml` beside the results, to repeat it."""

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.runs.request import RunRequest
from infthor_eval.settings import settings_of
from infthor_eval.storage.files import write_output, writing_hint

_FILE = "run.yaml"
_HEAD = (
    "# The options of this run: `infthor-eval run --config` with this file resumes or repeats it.\n"
)
_REPEATED = {"include_path"}  # options that are typed once for each value
_CHECKPOINT = "pretrained"  # the model option that may be a folder
_HINT = "write options of `infthor-eval run` by their long names, as `limit: 100`"


@dataclass(frozen=True)
class StoredCommand:
    """The command of a run in `run.yaml`.

    Attributes:
        options: options of `infthor-eval run` by their long names with `_` for `-`; several values
            are a list, those of `model_args` a mapping.
    """

    path: Path
    options: Mapping[str, Any]

    @property
    def data(self) -> Path | None:
        """Folder of the data set; None if it is the tasks' own or the published one."""
        return Path(self.options["data"]) if self.options.get("data") else None

    @property
    def line(self) -> str:
        """One line for a shell that resumes or repeats the run."""
        typed = [word for name, value in self.options.items() for word in _words(name, value)]
        model_args = self.options.get("model_args")
        if isinstance(model_args, Mapping) and any(
            "," in str(value) for value in model_args.values()
        ):
            typed = ["--config", str(self.path)]  # a value with a comma cannot be typed
        return shlex.join(["infthor-eval", "run", *typed])


def write_command(folder: Path, request: RunRequest) -> None:
    """Write `run.yaml` into a run's folder."""
    text = _HEAD + yaml.safe_dump(_options_of(request), sort_keys=False, allow_unicode=True)
    hint = writing_hint(" and run the same command again, which resumes it")
    with write_output(folder / _FILE, hint) as partial:
        partial.write_text(text, encoding="utf-8")


def read_stored_command(run_folder: Path) -> StoredCommand | None:
    """Read `run.yaml` of a run; None if there is none, as in runs of early versions.

    Raises:
        DataError: the file is not valid.
    """
    path = run_folder.absolute() / _FILE
    return StoredCommand(path, read_options(path)) if path.is_file() else None


def read_options(path: Path) -> dict[str, Any]:
    """Read the options in a file as they are written; their names are not checked."""
    options = read_yaml(path, _HINT)
    if not isinstance(options, dict) or not all(isinstance(name, str) for name in options):
        raise DataError(f"{path}: holds no options; {_HINT}")
    if not isinstance(options.get("model_args") or {}, dict | str):
        raise DataError(
            f"{path}: model_args is neither a mapping nor a text; write K: V below it, a line each"
        )
    if not isinstance(options.get("data") or "", str):
        raise DataError(f"{path}: data is {options['data']!r:.60}; write the name of a folder")
    # `out` by the name that it had in the files of earlier runs.
    return {"out" if name == "output" else name: value for name, value in options.items()}


def _options_of(request: RunRequest) -> dict[str, Any]:
    """Return a request's options. Keys of servers are none: they come from the environment."""
    tasks = request.tasks
    model_options = dict(request.model_options)
    if _CHECKPOINT in model_options:
        model_options[_CHECKPOINT] = _absolute(model_options[_CHECKPOINT])
    every = {
        "model": request.model,
        "model_args": model_options or None,
        "tasks": list(request.task_names),
        "include_path": [str(folder.absolute()) for folder in request.include] or None,
        "data": None if tasks.data is None else str(tasks.data.absolute()),
        "limit": tasks.limit,
        "seed": tasks.seed,
        "name": request.name,
        "out": str(request.output.absolute()),
        **_non_default(tasks.options),
        **_non_default(request.worker_settings),
    }
    return {name: value for name, value in every.items() if value is not None}


def _non_default(options: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that differ from their defaults."""
    if not is_dataclass(options):  # a suite without options
        return {}
    return {
        name: _absolute(value) if declared.setting.is_place else value
        for name, declared in settings_of(type(options)).items()
        if (value := getattr(options, name)) != declared.default
    }


def _absolute(text: str) -> str:
    """Return a path that exists as an absolute one, for any folder; a name of the hub as it is."""
    return str(Path(text).absolute()) if Path(text).exists() else text


def _words(name: str, value: Any) -> Iterator[str]:
    """Yield the words of an option as it is typed."""
    if value is None or value is False:
        return
    typed = f"--{name.replace('_', '-')}"
    if name in _REPEATED:
        yield from (word for one in value for word in (typed, str(one)))
        return
    yield typed
    if isinstance(value, Mapping):
        yield ",".join(f"{key}={setting}" for key, setting in value.items())
    elif isinstance(value, list):
        yield ",".join(map(str, value))
    elif value is not True:
        yield str(value)
