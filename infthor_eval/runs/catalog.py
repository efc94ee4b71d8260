"""The tasks that `--tasks` can name: this package's, other packages', and the user's own.

The files are lm-eval's own format, and say which suite evaluates them (`metadata: {suite: NAME}`).
lm-eval passes over a broken file without a word, so they are read and checked here first, without
importing lm-eval.
"""

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from infthor_eval.errors import DataError, UsageError, unknown_name, wrap_errors
from infthor_eval.formats.yaml_files import PlainLoader, read_yaml
from infthor_eval.storage.digests import canonical_json
from infthor_eval.storage.folders import packaged_folder

ENTRY_POINTS = "infthor_eval.tasks"  # a package's entry is "package.folder" with its task files

_HINT = "fix the task file"
# What lm-eval reads of a task and of a group (0.4.13), and the files that either includes.
KEYS = (
    *("task", "task_alias", "tag", "include", "custom_dataset", "dataset_path", "dataset_name"),
    *("dataset_kwargs", "training_split", "validation_split", "test_split", "fewshot_split"),
    *("process_docs", "doc_to_text", "doc_to_target", "doc_to_image", "doc_to_audio"),
    *("unsafe_code", "doc_to_choice", "process_results", "use_prompt", "description"),
    *("target_delimiter", "fewshot_delimiter", "fewshot_config", "num_fewshot", "metric_list"),
    *("output_type", "generation_kwargs", "repeats", "filter_list", "should_decontaminate"),
    *("doc_to_decontamination_query", "gen_prefix", "metadata"),
    *("group", "group_alias", "aggregate_metric_list"),
)


class _Loader(PlainLoader):
    """Plain YAML, with lm-eval's `!function module.name` kept as the name."""


_Loader.add_constructor("!function", lambda _, node: str(node.value))


@dataclass(frozen=True)
class TaskFile:
    """A single task.

    Attributes:
        suite: name of its suite.
        settings: contents of the file with those of the included files; functions by name.
        description: what the task evaluates, in a sentence; empty where the file has none.
    """

    name: str
    suite: str
    path: Path
    settings: Mapping[str, Any]
    description: str = ""

    def require(self, *keys: str) -> None:
        """Refuse a file that lacks keys which its suite needs.

        Raises:
            DataError: names the missing keys.
        """
        missing = [key for key in keys if key not in self.settings]
        if missing:
            raise DataError(
                f"{self.path}: no {', '.join(missing)}; tasks of {self.suite} need "
                f"{', '.join(keys)}"
            )


@dataclass(frozen=True)
class Catalog:
    """The task files below some folders.

    Attributes:
        folder: folder with the task files of this package; those of other folders may include what
            its tasks share (`include: _nieh.yaml`) as if it lay beside them.
        more: other folders.
    """

    folder: Path
    more: tuple[Path, ...] = ()

    @classmethod
    def find_packaged(cls) -> "Catalog":
        """Return the catalog of this package's tasks alone."""
        return cls(packaged_folder("tasks"))

    @classmethod
    def find_installed(cls, include: Sequence[Path] = ()) -> "Catalog":
        """Return the catalog of tasks in this package, other installed packages, further folders.

        Raises:
            UsageError: an installed package lacks the folder that it names.
        """
        others = (_folder_of(point) for point in entry_points(group=ENTRY_POINTS))
        return replace(cls.find_packaged(), more=(*others, *include))

    @cached_property
    def tasks(self) -> dict[str, TaskFile]:
        """All single tasks by name."""
        single = {name: entry for name, entry in self._entries.items() if "group" not in entry[1]}
        return {name: _task(name, path, settings) for name, (path, settings) in single.items()}

    @cached_property
    def groups(self) -> dict[str, list[str]]:
        """All groups by name, with the names of their tasks."""
        return {
            name: settings["task"]
            for name, (_, settings) in self._entries.items()
            if "group" in settings
        }

    def expand(self, names: Sequence[str]) -> list[TaskFile]:
        """Return the single tasks behind names of tasks and groups, each once, in the order given.

        Raises:
            UsageError: a name is unknown; the message has the nearest known one.
        """
        by_name: dict[str, TaskFile] = {}
        for name in names:
            if name in self.groups:
                by_name.update((task.name, task) for task in self._members(name, (name,)))
            elif name in self.tasks:
                by_name[name] = self.tasks[name]
            else:
                raise unknown_name("task", name, [*self.groups, *self.tasks])
        return list(by_name.values())

    def _members(self, group: str, inside: tuple[str, ...]) -> list[TaskFile]:
        """Return the single tasks of a group, nested or not; `inside` has the groups around it."""
        members: list[TaskFile] = []
        for name in self.groups[group]:
            if name in inside:
                raise DataError(
                    f"{self._entries[group][0]}: the group {name} is in itself; take it out"
                )
            members += (
                self._members(name, (*inside, name)) if name in self.groups else self.expand([name])
            )
        return members

    @cached_property
    def _entries(self) -> dict[str, tuple[Path, dict[str, Any]]]:
        entries: dict[str, tuple[Path, dict[str, Any]]] = {}
        for path in self._files():
            settings = self._settings(path)
            with wrap_errors(
                f"{path}: holds what JSON cannot", _HINT, catch=(TypeError, ValueError)
            ):
                canonical_json(settings)  # a part of the run's config
            name = settings.get("group") or settings.get("task")
            if not isinstance(name, str):
                raise DataError(
                    f"{path}: neither a task nor a group name; a task file has a key 'task' or "
                    "'group'"
                )
            if name in entries:
                raise DataError(
                    f"{path}: {name!r} is the name of another task file too; rename one"
                )
            names = settings.get("task")
            if "group" in settings and not (
                isinstance(names, list) and all(isinstance(task, str) for task in names)
            ):
                raise DataError(f"{path}: 'task' of a group must be a list of task names")
            entries[name] = path, settings
        return entries

    def _settings(self, path: Path, including: tuple[Path, ...] = ()) -> dict[str, Any]:
        """Return a file's settings over its includes'; `including`: the files that include it."""
        config = dict(self._read(path))
        included = config.pop("include", None)
        if included is None:
            return config
        if not isinstance(included, str):
            raise DataError(f"{path}: include is {included!r:.60}, not the name of a file; {_HINT}")
        beside = path.parent / included
        # ValueError: a null character in the name
        with wrap_errors(
            f"{path}: include is {included!r:.60}, no name of a file",
            _HINT,
            catch=(OSError, ValueError),
        ):
            other = (beside if beside.exists() else self._shared.get(included, beside)).resolve()
        if other in (*including, path.resolve()):
            raise DataError(f"{path}: includes {included}, which includes it; {_HINT}")
        return {**self._settings(other, (*including, path.resolve())), **config}

    @cached_property
    def _read(self) -> Callable[[Path], dict[str, Any]]:
        """What reads a file, each once."""
        return cache(_read)

    def _files(self) -> Iterator[Path]:
        for folder in (self.folder, *self.more):
            yield from (
                path for path in sorted(folder.rglob("*.yaml")) if not path.name.startswith("_")
            )

    @cached_property
    def _shared(self) -> dict[str, Path]:
        """Files that tasks of this package include, by name."""
        return {path.name: path for path in self.folder.rglob("_*.yaml")}


def _folder_of(point: EntryPoint) -> Path:
    """Return the folder of task files that a package names, without importing the package."""
    package, *inside = point.value.split(".")
    spec = find_spec(package)
    locations = spec.submodule_search_locations if spec is not None else None
    folders = [
        Path(location, *inside) for location in locations or () if Path(location, *inside).is_dir()
    ]
    if not folders:
        raise UsageError(
            f"the tasks {point.name} of another package are not in {point.value}; fix its package, "
            "or uninstall it"
        )
    return folders[0]


def _task(name: str, path: Path, settings: Mapping[str, Any]) -> TaskFile:
    metadata = settings.get("metadata")
    if not isinstance(metadata, Mapping) or not isinstance(metadata.get("suite"), str):
        raise DataError(
            f"{path}: no suite; write it as metadata: {{suite: NAME}} (NIEH tasks include "
            "_nieh.yaml)"
        )
    # The description changes no number, so it is no part of the settings, which the run's hash
    # depends on.
    others = {key: value for key, value in metadata.items() if key != "description"}
    return TaskFile(
        name,
        metadata["suite"],
        path,
        {**settings, "metadata": others},
        str(metadata.get("description", "")),
    )


def _read(path: Path) -> dict[str, Any]:
    config = read_yaml(path, _HINT, _Loader)
    if not isinstance(config, dict) or not all(isinstance(key, str) for key in config):
        raise DataError(f"{path}: not a mapping of settings; {_HINT}")
    for key in config:
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, n=1)
            hint = f"did you mean {near[0]}?" if near else "leave it out, or put it under metadata"
            raise DataError(f"{path}: {key} is not known; {hint}")
    return config
