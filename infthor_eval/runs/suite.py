"""The protocol between a kind of evaluation and the run that drives it.

A `Suite` is the kind: it knows its options, baselines and records, and turns records into summaries
and tables. Each further object exists only once all that it needs is known:

    Suite.prepare(request) -> Evaluation           what files hold, before the subject is loaded
    Evaluation.bind(subject) -> BoundEvaluation    groups that share expensive work; simulators
    BoundEvaluation.run(group, session)            a record per unit

`SuiteUnit` is the suite's unit, `Payload` the payload of its records.

To add or change what people see of a suite: its `overview` first, its `tables` with everything; its
one number, `primary_metrics`.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, Protocol, TypeVar

import msgspec

from infthor_eval.rates import Rate
from infthor_eval.runs.catalog import TaskFile
from infthor_eval.runs.completeness import UnitCounts, count_units
from infthor_eval.runs.config import RunConfig
from infthor_eval.runs.journals.records import (
    Artifact,
    Payload,
    RecordTypes,
    RunHeader,
    SuiteUnit,
    Unit,
    UnitKey,
    UnitRecord,
)
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.usage import NOTHING, Usage
from infthor_eval.tables import Table
from model_adapters import Capabilities, Subject

Need = Literal["conversation", "policy"]

Options_co = TypeVar("Options_co", covariant=True)
SuiteUnit_co = TypeVar("SuiteUnit_co", bound=Unit[Any], covariant=True)


@dataclass(frozen=True)
class TaskRequest(Generic[Options_co]):
    """The request of a run to a suite.

    Attributes:
        tasks: task files, all of this suite.
        options: instance of the suite's `options`.
        data: folder of the data set for tasks without their own.
        limit: number of items to evaluate of each task, chosen by `infthor_eval.runs.limiting`;
            None for all.
        seed: seed of everything random.
    """

    tasks: Sequence[TaskFile]
    options: Options_co
    data: Path | None = None
    limit: int | None = None
    seed: int = 0


@dataclass(frozen=True)
class Group(Generic[SuiteUnit_co]):
    """Units that share work, done one after the other in one place.

    Attributes:
        units: at least one unit.
        frames: number of distinct frames that the units look at; the cost of what they share grows
            with it.
    """

    units: Sequence[SuiteUnit_co]
    frames: int = 1


@dataclass(frozen=True)
class Skipped:
    """A unit that cannot be evaluated, and why."""

    key: UnitKey
    reason: str


@dataclass(frozen=True)
class Cost:
    """The cost of a task in words, known before its first unit."""

    task: str
    description: str


@dataclass(frozen=True)
class Workload(Generic[SuiteUnit_co]):
    """All the work of a run.

    Attributes:
        groups: the groups in the order of work, which depends on the request alone.
        skipped: units that cannot be evaluated.
        config: everything beside subject, limit and seed that the numbers depend on; of the
            suite's type (`RecordTypes.config`).
        costs: costs of the tasks, where they are known.
        warnings: what people should know before the first unit, such as a checkpoint that was
            trained otherwise.
        independent: true if no request depends on the reply to another, so that all may be asked
            together.
    """

    groups: Sequence[Group[SuiteUnit_co]]
    skipped: Sequence[Skipped] = ()
    config: RunConfig[Any] = field(default_factory=RunConfig)
    costs: Sequence[Cost] = ()
    warnings: Sequence[str] = ()
    independent: bool = False

    @property
    def n_units(self) -> int:
        """Number of units in all groups."""
        return sum(len(group.units) for group in self.groups)

    @property
    def units_by_task(self) -> dict[str, int]:
        """Number of units of each task."""
        return dict(Counter(unit.key.task for group in self.groups for unit in group.units))


class Session(Protocol[Payload]):
    """A run's results so far, for a suite that does a group; several threads may use it at once."""

    def find_record(self, unit: Unit[Payload], fingerprint: str) -> UnitRecord[Payload] | None:
        """Return the record of a unit that already has a result from these very inputs, or None."""

    def describe_failure(self, unit: Unit[Payload], error: BaseException) -> str:
        """Return why an exception made a unit fail, and keep an unexpected one's traceback."""

    def find_artifact(self, fingerprint: str, kind: type[Artifact]) -> Artifact | None:
        """Return the cached artifact of these inputs, or None."""

    def cache_artifact(self, fingerprint: str, artifact: Any, usage: Usage = NOTHING) -> None:
        """Cache an artifact for when the run is resumed, with what its requests took."""


def keep_request(request: StoredRequest | None, session: Session[Any]) -> str:
    """Put a request into the journal unless it is there; return the name that records have, which
    is empty for none."""
    if request is None:
        return ""
    name = request.fingerprint
    if session.find_artifact(name, StoredRequest) is None:
        session.cache_artifact(name, request)
    return name


@dataclass(frozen=True)
class UnitDoc:
    """A unit as lm-eval's files have it, which tell more of it than its record does.

    Attributes:
        number: position among the units of its task, repetitions counted once.
        doc: what is asked, as JSON values, from the data set.
        target: the expected result in words.
        prompt: the request in words, with a placeholder for each frame.
        settings: decoding settings in lm-eval's words.
        reply: the reply or the actions; empty where the unit failed.
    """

    number: int
    doc: Mapping[str, Any]
    target: str
    prompt: str
    settings: Mapping[str, Any]
    reply: str


class BoundEvaluation(Protocol[SuiteUnit, Payload]):
    """An evaluation of one subject, which owns what depends on it, such as its simulators."""

    @property
    def workload(self) -> Workload[SuiteUnit]:
        """All the work; the same object every time."""

    def run(
        self, group: Group[SuiteUnit], session: Session[Payload]
    ) -> Iterator[UnitRecord[Payload]]:
        """Do a group: yield a record per unit when it is there; those in the session as they are.

        Raises:
            InfthorError: the units without a record cannot be done. The run records them as failed
                and goes on. So it does with any other exception, which is a fault of the suite;
                only MemoryError ends the run.
        """

    def close(self) -> None:
        """Release what the work needed (simulators); called once, also if it was not finished."""


class Evaluation(Protocol[SuiteUnit, Payload]):
    """A suite set up for a run. It holds only what files hold, and may be bound more than once.

    One may have `reuses_encodings`, which is true if runs of one model that follow each other ask
    behind what it has encoded before; then they share the loaded model.
    """

    def bind(self, subject: Subject) -> BoundEvaluation[SuiteUnit, Payload]:
        """Find all the work for a subject.

        Raises:
            UsageError: nothing can be evaluated, or not with this subject.
            DataError: the data do not match their format.
            ModelError: the model can take none of the units.
        """

    def to_doc(self, header: RunHeader[Any], record: UnitRecord[Payload]) -> UnitDoc:
        """Convert a record of a run of this work for lm-eval's files; nothing need be bound."""


class Suite(Protocol[SuiteUnit, Payload]):
    """A kind of evaluation.

    Attributes:
        name: name in task files (`metadata: {suite: NAME}`).
        needs: what a subject must be able to do, unless it is a baseline of the suite.
        options: dataclass of the suite's options beside its task files, with defaults.
        baselines: the suite's baselines: name to a function of the seed.
    """

    name: ClassVar[str]
    needs: ClassVar[Need]
    options: ClassVar[type]
    baselines: ClassVar[Mapping[str, Callable[[int], Subject]]]

    @property
    def records(self) -> RecordTypes[Payload]:
        """Payloads of the suite's records."""

    def check_task(self, task: TaskFile) -> None:
        """Check the settings of a task file, without its data.

        Raises:
            UsageError: a setting that does not fit.
            DataError: the file does not match its format.
        """

    def prepare(self, request: TaskRequest[Any]) -> Evaluation[SuiteUnit, Payload]:
        """Set up a run. What can be refused without the subject is refused before it is loaded.

        Raises:
            UsageError: a task or an option that does not fit.
            DataError: the data do not match their format.
        """

    def summarise(
        self, header: RunHeader, records: Sequence[UnitRecord[Payload]]
    ) -> msgspec.Struct:
        """Summarise a run: a pure function of its journal, equal for equal records.

        What differs between a run and the same run resumed (times) is at most in a field `took`,
        which results.json leaves out. A summary with a method `document` says itself what is in
        results.json.
        """

    def scores(self, record: UnitRecord[Payload]) -> Mapping[str, float]:
        """Return a unit's metrics by name; a missing one is 0, unless the unit has no result
        (`UnitRecord.state`), which counts in no mean."""

    def primary_metrics(self, summary: Any) -> Mapping[str, Rate]:
        """Return each task's primary metric, a share from 0 to 1, over the units with a result;
        none where there is no such unit."""

    def overview(self, runs: Sequence["RunSummary"]) -> Sequence[Table]:
        """Return what people see first of runs side by side, at most 100 columns wide."""

    def tables(self, runs: Sequence["RunSummary"]) -> Sequence[Table]:
        """Return all results of runs of this suite, with the published numbers beside them."""


@dataclass(frozen=True)
class RunSummary:
    """A run summed up.

    Attributes:
        header: header of its journal.
        summary: summary by its suite (`Suite.summarise`).
        units: numbers of units of each task by state.
    """

    header: RunHeader
    summary: Any
    units: Mapping[str, UnitCounts] = field(default_factory=dict)

    @classmethod
    def of(
        cls, suite: Suite[Any, Any], header: RunHeader, records: Sequence[UnitRecord[Any]]
    ) -> "RunSummary":
        """Sum up the records of a run of a suite."""
        return cls(header, suite.summarise(header, records), count_units(header, records))


class BaselineSubject:
    """A subject without options that sees no frame and holds no resource."""

    name = ""
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, seed: int) -> None:
        """Take the seed of the run."""
        self._seed = seed

    def identity(self) -> dict[str, Any]:
        """Return the name; what is drawn depends on the seed, which the run's config has anyway."""
        return {"baseline": self.name}

    def close(self) -> None:
        """Nothing is held."""
