"""The tasks that the package brings: what `--tasks` can name.

The files are lm-eval's own format, and say which suite evaluates them (`metadata: {suite: NAME}`). lm-eval passes over
a broken file without a word, so they are read and checked here first, without importing lm-eval.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError, unknown_name
from infthor_eval.formats.packaged import packaged_folder

__all__ = ["Catalog", "TaskFile"]


class _Loader(yaml.SafeLoader):
    """Plain YAML, with lm-eval's `!function module.name` kept as the name."""


def _function_name(_: _Loader, node: yaml.Node) -> str:
    return str(node.value)


_Loader.add_constructor("!function", _function_name)


@dataclass(frozen=True)
class TaskFile:
    """A single task.

    Attributes:
        name: the task.
        suite: the kind of evaluation that it belongs to.
        path: its file.
        settings: what the file says, with the included ones merged in; functions by name.
    """

    name: str
    suite: str
    path: Path
    settings: Mapping[str, Any]

    def require(self, *keys: str) -> None:
        """Refuse a file that lacks a key which its suite needs.

        Raises:
            DataError: names the missing ones.
        """
        missing = [key for key in keys if key not in self.settings]
        if missing:
            raise DataError(f"{self.path}: no {', '.join(missing)}; tasks of {self.suite} need {', '.join(keys)}")


@dataclass(frozen=True)
class Catalog:
    """The task files below one folder."""

    folder: Path

    @classmethod
    def packaged(cls) -> "Catalog":
        """The tasks of this installation."""
        return cls(packaged_folder("tasks"))

    @cached_property
    def tasks(self) -> dict[str, TaskFile]:
        """Every single task by name."""
        single = {name: entry for name, entry in self._entries.items() if "group" not in entry[1]}
        return {name: _task(name, path, settings) for name, (path, settings) in single.items()}

    @cached_property
    def groups(self) -> dict[str, list[str]]:
        """Every group by name, with the names in it."""
        return {name: settings["task"] for name, (_, settings) in self._entries.items() if "group" in settings}

    def expand(self, names: Sequence[str]) -> list[TaskFile]:
        """The single tasks behind names of tasks and groups, each once, in the order given.

        Raises:
            UsageError: a name is unknown; the nearest known one is named.
        """
        found: dict[str, TaskFile] = {}
        for name in names:
            if name in self.groups:
                found.update((task.name, task) for task in self.expand(self.groups[name]))
            elif name in self.tasks:
                found[name] = self.tasks[name]
            else:
                raise unknown_name("task", name, [*self.groups, *self.tasks])
        return list(found.values())

    @cached_property
    def _entries(self) -> dict[str, tuple[Path, dict[str, Any]]]:
        entries: dict[str, tuple[Path, dict[str, Any]]] = {}
        for path in sorted(self.folder.rglob("*.yaml")):
            if path.name.startswith("_"):
                continue
            settings = _read(path)
            name = settings.get("group") or settings.get("task")
            if not isinstance(name, str):
                raise DataError(f"{path}: neither a task nor a group name; a task file has a key 'task' or 'group'")
            if name in entries:
                raise DataError(f"{path}: {name!r} is the name of another task file too; rename one")
            if "group" in settings and not isinstance(settings.get("task"), list):
                raise DataError(f"{path}: 'task' of a group must be a list of task names")
            entries[name] = path, settings
        return entries


def _task(name: str, path: Path, settings: Mapping[str, Any]) -> TaskFile:
    metadata = settings.get("metadata")
    suite = metadata.get("suite") if isinstance(metadata, Mapping) else None
    if not isinstance(suite, str):
        raise DataError(f"{path}: no suite; write it as metadata: {{suite: NAME}} (NIEH tasks include _nieh.yaml)")
    return TaskFile(name, suite, path, settings)


def _read(path: Path) -> dict[str, Any]:
    try:
        config = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    except yaml.YAMLError as error:
        raise DataError(f"{path}: not YAML ({' '.join(str(error).split())})") from error
    if not isinstance(config, dict):
        raise DataError(f"{path}: not a mapping of settings")
    included = config.pop("include", None)
    return {**(_read(path.parent / included) if included else {}), **config}
