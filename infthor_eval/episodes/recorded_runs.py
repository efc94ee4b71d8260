"""Runs of episodes as their journals have them: for curves over several runs, and for replays."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from infthor_eval.episodes.config import EpisodesConfig
from infthor_eval.episodes.records import P
from infthor_eval.runs import RunHeader, UnitRecord

_EMBEDDED = "embedded"  # as the option --simulator names it


C = TypeVar("C", bound=EpisodesConfig[Any])


@dataclass(frozen=True)
class RecordedRun(Generic[P, C]):
    """The journal of a run of episodes; `label` names it beside other runs."""

    label: str
    header: RunHeader[C]
    records: Sequence[UnitRecord[P]]

    planner: ClassVar[str]  # the upper bound's name; its own module would import the simulator

    @property
    def config(self) -> C:
        """The run's config."""
        return self.header.config

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
