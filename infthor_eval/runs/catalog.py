"""The tasks that the package brings: what `--tasks` can name.

The files are lm-eval's own format. lm-eval passes over a broken file without a word, so they are read and checked
here first, without importing lm-eval.
"""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.packaged import packaged_folder

__all__ = ["Catalog"]

_NEEDED = (
    "custom_dataset",
    "dataset_kwargs",
    "doc_to_text",
    "generation_kwargs",
    "process_results",
    "test_split",
)


class _Loader(yaml.SafeLoader):
    """Plain YAML, with lm-eval's `!function module.name` kept as the name."""


def _function_name(_: _Loader, node: yaml.Node) -> str:
    return str(node.value)


_Loader.add_constructor("!function", _function_name)


@dataclass(frozen=True)
class Catalog:
    """The task files below one folder."""

    folder: Path

    @classmethod
    def packaged(cls) -> "Catalog":
        """The tasks of this installation."""
        return cls(packaged_folder("tasks"))

    @cached_property
    def tasks(self) -> dict[str, dict[str, Any]]:
        """Every single task by name, its file's settings with the included ones merged in."""
        return {name: config for name, config in self._entries.items() if "group" not in config}

    @cached_property
    def groups(self) -> dict[str, list[str]]:
        """Every group by name, with the names in it."""
        return {name: config["task"] for name, config in self._entries.items() if "group" in config}

    def expand(self, names: Sequence[str]) -> list[str]:
        """The single tasks behind names of tasks and groups, each once, in the order given.

        Raises:
            UsageError: a name is unknown; the nearest known one is named.
        """
        found: dict[str, None] = {}
        for name in names:
            if name in self.groups:
                found.update(dict.fromkeys(self.expand(self.groups[name])))
            elif name in self.tasks:
                found[name] = None
            else:
                raise UsageError(self._unknown(name))
        return list(found)

    def _unknown(self, name: str) -> str:
        known = [*self.groups, *self.tasks]
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(sorted(known))}"
        return f"unknown task {name!r}; {hint}"

    @cached_property
    def _entries(self) -> dict[str, dict[str, Any]]:
        entries: dict[str, dict[str, Any]] = {}
        for path in sorted(self.folder.rglob("*.yaml")):
            if path.name.startswith("_"):
                continue
            config = _read(path)
            name = config.get("group") or config.get("task")
            if not isinstance(name, str):
                raise DataError(f"{path}: neither a task nor a group name; a task file has a key 'task' or 'group'")
            if name in entries:
                raise DataError(f"{path}: {name!r} is the name of another task file too; rename one")
            _check(config, path)
            entries[name] = config
        return entries


def _check(config: Mapping[str, Any], path: Path) -> None:
    if "group" in config:
        if not isinstance(config.get("task"), list):
            raise DataError(f"{path}: 'task' of a group must be a list of task names")
        return
    missing = [key for key in _NEEDED if key not in config]
    if missing:
        raise DataError(f"{path}: no {', '.join(missing)}; a task file needs them (include _nieh.yaml)")


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
