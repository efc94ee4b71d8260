"""The lines of a journal: the run's header, records of units, and cached artifacts.

A line is a JSON object whose `type` is one of the three. A unit's envelope is the same for every
suite. Its payload is the suite's own, and tagged in turn.
"""

from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Generic, Literal, NamedTuple, TypeVar

import msgspec

from infthor_eval.errors import InfthorError, describe_exception
from infthor_eval.quantities import Amount, Count, Repetition, Total
from infthor_eval.runs.config import Config, RunConfig
from infthor_eval.runs.journals.requests import StoredRequest
from infthor_eval.runs.usage import NOTHING, Usage

FORMAT = 3

State = Literal["answered", "failed", "not asked", "excluded"]

_Name = Annotated[str, msgspec.Meta(min_length=1)]

Artifact = TypeVar("Artifact")  # what a suite caches
Payload = TypeVar("Payload")  # the payload of a suite's records
Payload_co = TypeVar("Payload_co", covariant=True)
SuiteUnit = TypeVar("SuiteUnit", bound="Unit[Any]")  # a suite's unit


class UnitKey(NamedTuple):
    """The key of a unit within its run.

    Attributes:
        task: name of the task.
        id: id of the question or the episode.
        variant: variant of the task's evaluation of it ("depth=0.4"); empty where there is only
            one.
        repeat: number of its repetition, from 1, where it is evaluated several times.
    """

    task: str
    id: str
    variant: str = ""
    repeat: int = 1

    def __str__(self) -> str:
        number = f"({self.repeat})" if self.repeat > 1 else ""
        return " ".join(filter(None, (self.id, self.variant, number)))

    @property
    def once(self) -> "UnitKey":
        """The key without the number of the repetition: that of the first."""
        return self._replace(repeat=1)


class Typed(msgspec.Struct, frozen=True, omit_defaults=True, tag_field="type"):
    """What a journal tells by its `type`, and writes without the values that are defaults."""


class Tokens(msgspec.Struct, frozen=True, omit_defaults=True):
    """Tokens of requests, of those not encoded again, and of replies; None if not counted."""

    context: Count | None = None
    cached: Count | None = None
    reply: Count | None = None


class ReadHashes(msgspec.Struct, frozen=True, omit_defaults=True):
    """Hashes of what the model read: the ids of the context's tokens, and the pixels of its frames;
    None if they are not known."""

    context: str | None = None
    frames: str | None = None


class RunHeader(
    msgspec.Struct, Generic[Config], frozen=True, kw_only=True, tag_field="type", tag="run"
):
    """The header of a run: the first line of each shard.

    Attributes:
        suite: name of the suite, which knows the payloads.
        name: name of the run in tables and folders.
        config: everything that can change a number; of the suite's own type where the suite is
            known, else with the configs of tasks as JSON values.
        n_units: number of units of the run; None where its records were made without a driver.
        units_by_task: number of units of each task; empty where that is not known.
        format: format of the journal.
    """

    suite: str
    name: str
    config: Config
    n_units: Count | None = None
    units_by_task: dict[str, Count] = {}
    format: int = FORMAT

    @property
    def label(self) -> str:
        """Name of the run in tables, with what replaces the frames."""
        return self.with_frames(self.name)

    def with_frames(self, name: str) -> str:
        """Return a name of the run, or of a task of it, with its frame ablation if it has one."""
        frames = self.config.frames
        return name if frames in ("", "shown") else f"{name}, {frames} frames"


class UnitRecord(Typed, Generic[Payload], frozen=True, kw_only=True, tag="unit"):
    """A unit that was evaluated, or the reason why it could not be.

    Attributes:
        cluster: name of what it shares with units that are right or wrong together (a trajectory),
            for intervals.
        fingerprint: hash of all its inputs; empty if they could not be read.
        payload: the suite's own struct.
        attempt: number of the attempt, from 1.
        failure: reason why there is no result; None if there is one.
        asked: False if there is no result because the subject was not asked, by the user's wish (a
            cap on the cost).
        excluded: reason why the unit does not count, through no fault of the subject; None if it
            counts.
        faults: faults that were retried, a line each.
        seconds: duration.
        tokens: tokens of the unit.
        usage: usage of all its requests.
        read: hashes of what the model read.
        request: name of the stored request (`StoredRequest.fingerprint`); empty if none was made.
    """

    task: _Name
    id: _Name
    cluster: _Name
    fingerprint: str
    payload: Payload
    variant: str = ""
    repeat: Repetition = 1
    attempt: Total = 1
    failure: str | None = None
    asked: bool = True
    excluded: str | None = None
    faults: tuple[str, ...] = ()
    seconds: Amount = 0.0
    tokens: Tokens = Tokens()
    usage: Usage = NOTHING
    read: ReadHashes = ReadHashes()
    request: str = ""

    @property
    def key(self) -> UnitKey:
        """Key of the unit."""
        return UnitKey(self.task, self.id, self.variant, self.repeat)

    @property
    def state(self) -> State:
        """Whether there is a result, and if not, why; docs/reference/metrics.md defines them."""
        return state_of(self.failure, self.excluded, asked=self.asked)


class ArtifactRecord(Typed, Generic[Payload], frozen=True, kw_only=True, tag="artifact"):
    """A cached artifact: a suite's intermediate result, which a resumed run does not repeat.

    Attributes:
        fingerprint: hash of all its inputs, by which it is looked up.
        payload: the suite's own struct.
        usage: what the requests behind it took.
    """

    fingerprint: str
    payload: Payload
    usage: Usage = NOTHING


@dataclass(frozen=True)
class RecordTypes(Generic[Payload_co]):
    """The types of what a suite writes into a journal; payloads are msgspec structs with a tag.

    Attributes:
        unit: payload of its units.
        artifact: payload of its cached artifacts besides requests, a union if there are several
            kinds; None where it caches none.
        config: config of its runs.
    """

    unit: type[Payload_co]
    artifact: type[Any] | UnionType | None = None
    config: type[RunConfig[Any]] = RunConfig[dict[str, Any]]

    def decoder(self) -> msgspec.json.Decoder[Any]:
        """Return the decoder of a journal's lines."""
        header: Any = RunHeader[self.config]  # type: ignore[name-defined]
        record: Any = UnitRecord[self.unit]  # type: ignore[name-defined]
        cached = StoredRequest if self.artifact is None else StoredRequest | self.artifact
        artifact: Any = ArtifactRecord[cached]  # type: ignore[valid-type]
        return msgspec.json.Decoder(header | record | artifact)

    def header_decoder(self) -> msgspec.json.Decoder[RunHeader[Any]]:
        """Return the decoder of a journal's first line."""
        return msgspec.json.Decoder(RunHeader[self.config])  # type: ignore[name-defined]


def state_of(failure: str | None, excluded: str | None, *, asked: bool) -> State:
    """Return the state of a unit by the fields of its record."""
    if excluded is not None:
        return "excluded"
    if failure is None:
        return "answered"
    return "failed" if asked else "not asked"


def describe_failure(error: BaseException) -> str:
    """Return an expected error's message; another's type, place and message, in one line."""
    if isinstance(error, InfthorError):
        return str(error)
    return f"{describe_exception(error)}; fix the suite and run the same command again"


@dataclass(frozen=True)
class Unit(Generic[Payload]):
    """The smallest piece of work with a record of its own: a sample or an episode.

    Attributes:
        key: key of the unit.
        cluster: see `UnitRecord`.
        payload: payload before the unit is evaluated; recorded as it is if the unit fails.
    """

    key: UnitKey
    cluster: str
    payload: Payload

    def without_inputs(self) -> "Unit[Payload]":
        """Return what records its failure in another process, without the suite's own inputs."""
        return Unit(self.key, self.cluster, self.payload)

    def record(self, fingerprint: str, payload: Payload, **envelope: Any) -> UnitRecord[Payload]:
        """Return its record; further fields of the envelope (see `UnitRecord`) are keywords."""
        return UnitRecord(
            **self.key._asdict(),
            cluster=self.cluster,
            fingerprint=fingerprint,
            payload=payload,
            **envelope,
        )

    def record_failure(
        self, reason: str, fingerprint: str = "", **envelope: Any
    ) -> UnitRecord[Payload]:
        """Return its record if there is no result."""
        return self.record(fingerprint, self.payload, failure=reason, **envelope)

    def record_exclusion(
        self, reason: str, fingerprint: str, **envelope: Any
    ) -> UnitRecord[Payload]:
        """Return its record if it turns out that no subject can be evaluated on it."""
        return self.record(fingerprint, self.payload, excluded=reason, **envelope)
