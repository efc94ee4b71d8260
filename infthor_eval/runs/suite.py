"""What a kind of evaluation is to the run that drives it.

A `Suite` is the kind: it knows its options, its baselines and its records, and makes summaries and tables of them. An
`Evaluation` is a suite set up for one run: it finds the work, in groups that share what is expensive, and does a group.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Literal, Protocol

import msgspec

from infthor_eval.rates import Rate
from infthor_eval.runs.catalog import TaskFile
from infthor_eval.runs.records import RecordTypes, RunHeader, Unit, UnitKey, UnitRecord
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.tables import Table
from model_adapters import Subject

__all__ = [
    "Cost",
    "Evaluation",
    "Group",
    "Need",
    "RunSummary",
    "Session",
    "Skipped",
    "Suite",
    "TaskRequest",
    "UnitSample",
    "Workload",
]

Need = Literal["conversation", "policy"]


@dataclass(frozen=True)
class TaskRequest:
    """What a run asks of a suite.

    Attributes:
        tasks: the task files, all of this suite.
        options: an instance of the suite's `Options`.
        data: folder of the data set for tasks that do not bring their own.
        limit: evaluate only so many items of each task; which, `infthor_eval.runs.limiting` says.
        seed: for whatever is random.
    """

    tasks: Sequence[TaskFile]
    options: Any
    data: Path | None = None
    limit: int | None = None
    seed: int = 0


@dataclass(frozen=True)
class Group:
    """Units that share work, done one after the other in one place.

    Attributes:
        units: at least one.
        context: what the suite itself wants to know when it does them.
        frames: that the units look at, each counted once; what they share grows with it.
    """

    units: Sequence[Unit[Any]]
    context: Any = None
    frames: int = 1


@dataclass(frozen=True)
class Skipped:
    """A unit that cannot be evaluated, and why."""

    key: UnitKey
    reason: str


@dataclass(frozen=True)
class Cost:
    """What a task will cost, told before the first unit.

    Attributes:
        task: which task.
        description: in words, for people.
    """

    task: str
    description: str


@dataclass(frozen=True)
class Workload:
    """All that a run has to do.

    Attributes:
        groups: in the order of work, which depends on the request alone.
        skipped: what cannot be evaluated.
        identity: what the numbers depend on besides the subject and the seed, as JSON values.
        costs: of the tasks.
    """

    groups: Sequence[Group]
    skipped: Sequence[Skipped] = ()
    identity: Mapping[str, Any] = field(default_factory=dict)
    costs: Sequence[Cost] = ()

    @property
    def n_units(self) -> int:
        """How many units there are."""
        return sum(len(group.units) for group in self.groups)


class Session(Protocol):
    """What a suite works with while it does a group; several threads may use it at once."""

    @property
    def subject(self) -> Subject:
        """What is evaluated."""
        ...

    def known(self, unit: Unit[Any], fingerprint: str) -> UnitRecord[Any] | None:
        """The record of an earlier run, if the unit has a result from these very inputs."""
        ...

    def memo(self, fingerprint: str) -> Any | None:
        """The payload that was kept under these inputs, if one was."""
        ...

    def keep(self, fingerprint: str, payload: Any, usage: Usage = NOTHING) -> None:
        """Keep a payload for when the run is resumed, with what its requests took; nothing if not given."""
        ...


@dataclass(frozen=True)
class UnitSample:
    """A unit and its result, for readers that know no suites (lm-eval's format).

    Attributes:
        number: its place among those of its task.
        doc: what it is, as JSON values.
        target: what was wanted, in words.
        prompt: what was asked, in words, with a placeholder for each frame.
        settings: how the reply was decoded, in lm-eval's words.
        reply: what was said or done; empty where it failed.
    """

    number: int
    doc: Mapping[str, Any]
    target: str
    prompt: str
    settings: Mapping[str, Any]
    reply: str


class Evaluation(Protocol):
    """A suite set up for one run."""

    def workload(self, subject: Subject) -> Workload:
        """Find all that is to be done; called once, before the first unit.

        Raises:
            UsageError: nothing can be evaluated, or not with this subject.
            DataError: the data are not what their format says.
            ModelError: the model can take none of the units.
        """
        ...

    def run(self, group: Group, session: Session) -> Iterator[UnitRecord[Any]]:
        """Do a group: a record per unit, as soon as it is there, the known ones as they are.

        Raises:
            InfthorError: the units that have no record yet cannot be done; the run records them as failed, and goes on.
                So it does where anything else is raised, which is a fault of the suite and recorded with its place;
                MemoryError alone ends the run.
        """
        ...

    def view(self, record: UnitRecord[Any]) -> UnitSample:
        """A record for other readers; called after the work was found."""
        ...

    def close(self) -> None:
        """Let go of what the work needed (simulators); called once all of it is done, or given up."""
        ...


class Suite(Protocol):
    """A kind of evaluation.

    Attributes:
        name: as task files write it (`metadata: {suite: NAME}`).
        needs: what a subject that is no baseline must be able to do.
        options: a dataclass of what the suite can be told beside its task files, with defaults.
        baselines: the suite's own yardsticks: name to a function of the seed.
        records: payloads of its records.
    """

    name: ClassVar[str]
    needs: ClassVar[Need]
    options: ClassVar[type]
    baselines: ClassVar[Mapping[str, Callable[[int], Subject]]]
    records: ClassVar[RecordTypes]

    def prepare(self, request: TaskRequest) -> Evaluation:
        """Set up a run; whatever can be refused without the subject is refused here, before it is loaded.

        Raises:
            UsageError: a task or an option that does not fit.
            DataError: the data are not what their format says.
        """
        ...

    def summarise(self, header: RunHeader, records: Sequence[UnitRecord[Any]]) -> msgspec.Struct:
        """Everything that a run found: a pure function of its journal, without times, equal for equal records."""
        ...

    def scores(self, record: UnitRecord[Any]) -> Mapping[str, float]:
        """The metrics of one unit by name; one that is missing, as all are where it failed, counts as 0."""
        ...

    def primary_metrics(self, summary: Any) -> Mapping[str, Rate]:
        """The number that each task is known by, a share from 0 to 1; a task of which nothing counts has none."""
        ...

    def overview(self, runs: Sequence["RunSummary"]) -> Sequence[Table]:
        """What people are shown first of runs of this suite, side by side: what fits a screen of 100 columns."""
        ...

    def tables(self, runs: Sequence["RunSummary"]) -> Sequence[Table]:
        """All that there is to be shown of them, and the published numbers beside it."""
        ...


@dataclass(frozen=True)
class RunSummary:
    """A run, summed up: who it is, and what its suite says that it found."""

    header: RunHeader
    summary: Any
