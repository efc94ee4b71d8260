"""Runs of episodes as their journals have them: for curves over several runs, and for replays."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import msgspec

from infthor_eval.episodes.records import P
from infthor_eval.errors import wrap_errors
from infthor_eval.runs import RecordTypes, RunHeader, UnitRecord, read_run

__all__ = ["RecordedRun", "RunConfig", "TaskConfig"]

_EMBEDDED = "embedded"  # as the option --simulator names it


class TaskConfig(msgspec.Struct, frozen=True, kw_only=True):
    """The part of a task's run config that curves and replays need: digests of trajectories by
    name, and settings."""

    trajectories: dict[str, str]
    config: dict[str, Any] = {}

    @property
    def settings(self) -> Mapping[str, Any]:
        """`dataset_kwargs` of the task file."""
        settings = self.config.get("dataset_kwargs")
        return settings if isinstance(settings, Mapping) else {}


T = TypeVar("T", bound=TaskConfig)


class RunConfig(msgspec.Struct, Generic[T], frozen=True):
    """The part of a run's config that curves and replays need; `model` has the subject's name and
    options."""

    model: dict[str, Any]
    simulator: str
    tasks: dict[str, T]


@dataclass(frozen=True)
class RecordedRun(Generic[P, T]):
    """The journal of a run of episodes; `label` names it beside other runs."""

    label: str
    header: RunHeader
    records: Sequence[UnitRecord[P]]

    suite: ClassVar[str]
    record_types: ClassVar[RecordTypes]
    task_config: ClassVar[type[TaskConfig]]
    planner: ClassVar[
        str
    ]  # the baseline that is an upper bound; its own module would import the simulator

    @classmethod
    def read(cls, folder: Path, label: str | None = None) -> Self:
        """Read the run in a folder, by default labelled by its own name; DataError for a missing or
        damaged journal."""
        header, records = read_run(folder, cls.record_types)
        return cls(label or header.name, header, records)

    @cached_property
    def config(self) -> RunConfig[T]:
        """The run's config; raises DataError if it is not that of a run of this suite."""
        problem = f"{self.label}: not the config of a run of {self.suite}"
        with wrap_errors(
            problem, "start the run again with --fresh", catch=msgspec.ValidationError
        ):
            config: RunConfig[T] = msgspec.convert(self.header.config, RunConfig[self.task_config])  # type: ignore[name-defined]
        return config

    @property
    def is_planner(self) -> bool:
        """Whether the subject is the baseline that knows the solution."""
        return bool(self.config.model.get("baseline") == self.planner)

    @property
    def is_embedded(self) -> bool:
        """Whether the run used the embedded simulator."""
        return self.config.simulator == _EMBEDDED

    def by_trajectory(
        self, tasks: Collection[str]
    ) -> dict[str, dict[tuple[int, str], UnitRecord[P]]]:
        """Return the records of some tasks by trajectory, then by place in it and task."""
        records: dict[str, dict[tuple[int, str], UnitRecord[P]]] = {}
        for record in self.records:
            if record.task in tasks:
                records.setdefault(record.cluster, {})[record.payload.index, record.task] = record
        return records

    def digests(self, tasks: Sequence[str]) -> dict[str, str]:
        """Return the digests of some tasks' trajectories, by name."""
        return {
            name: digest
            for task in tasks
            for name, digest in self.config.tasks[task].trajectories.items()
        }
