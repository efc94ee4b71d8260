"""What a journal holds: who the run is, finished units, and what a suite found on the way to them.

A line is a JSON object whose `type` says which of the three it is. A unit's envelope is the same for every suite; what
the suite itself has to say of it is the payload, tagged in turn.
"""

from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec

from infthor_eval.runs.usage import NOTHING, Usage

__all__ = ["FORMAT", "ArtifactRecord", "RecordTypes", "RunHeader", "Tokens", "Unit", "UnitKey", "UnitRecord"]

FORMAT = 3

P = TypeVar("P")
P_co = TypeVar("P_co", covariant=True)


class UnitKey(NamedTuple):
    """Which unit of a run.

    Attributes:
        task: the task that asks.
        id: the question, the episode: what is evaluated.
        variant: which of the task's ways of evaluating it ("depth=0.4"); empty where there is one.
    """

    task: str
    id: str
    variant: str = ""

    def __str__(self) -> str:
        return f"{self.id} {self.variant}".strip()


class Tokens(msgspec.Struct, frozen=True, omit_defaults=True):
    """Tokens that a unit took; None where the model does not tell.

    Attributes:
        context: length of its requests.
        cached: how many of them were not encoded again.
        reply: length of the replies.
    """

    context: int | None = None
    cached: int | None = None
    reply: int | None = None


class RunHeader(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", tag="run"):
    """Who a run is: the first line of each of its shards.

    Attributes:
        suite: the kind of evaluation, which knows the payloads.
        name: what the run is called in tables and folders.
        config: everything that can change a number, as JSON values.
        format: of the journal.
    """

    suite: str
    name: str
    config: dict[str, Any]
    format: int = FORMAT


class UnitRecord(
    msgspec.Struct, Generic[P], frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="unit"
):
    """One unit that was evaluated, or the reason why it could not be.

    Attributes:
        task: see `UnitKey`.
        id: see `UnitKey`.
        variant: see `UnitKey`.
        cluster: what it shares with units that are right or wrong together (a trajectory); intervals cluster by it.
        fingerprint: of all its inputs; empty where they could not be read.
        payload: what the suite has to say of it.
        attempt: how many times it has been tried, this one included.
        failure: why there is no result; None where there is one.
        excluded: why it does not count, through no fault of the subject; None where it does.
        faults: what went wrong and was survived on the way, a line each.
        seconds: time that it took.
        tokens: tokens that it took.
        usage: what all its requests took together.
    """

    task: str
    id: str
    cluster: str
    fingerprint: str
    payload: P
    variant: str = ""
    attempt: int = 1
    failure: str | None = None
    excluded: str | None = None
    faults: tuple[str, ...] = ()
    seconds: float = 0.0
    tokens: Tokens = Tokens()
    usage: Usage = NOTHING

    @property
    def key(self) -> UnitKey:
        """Which unit of the run this is."""
        return UnitKey(self.task, self.id, self.variant)


class ArtifactRecord(
    msgspec.Struct, Generic[P], frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="artifact"
):
    """A cached artifact: an intermediate result of a suite that a resumed run does not compute again.

    Attributes:
        fingerprint: hash of all its inputs, by which it is looked up.
        payload: the suite's own struct.
        usage: what the requests behind it took.
    """

    fingerprint: str
    payload: P
    usage: Usage = NOTHING


@dataclass(frozen=True)
class RecordTypes(Generic[P_co]):
    """The payloads of a suite's records: msgspec structs with a tag.

    Attributes:
        unit: payload of its units.
        artifact: payload of its cached artifacts; None where it caches none.
    """

    unit: type[P_co]
    artifact: type[Any] | None = None

    def decoder(self) -> msgspec.json.Decoder[Any]:
        """The decoder of a journal's lines."""
        lines: Any = RunHeader | UnitRecord[self.unit] | ArtifactRecord[self.artifact]  # type: ignore[name-defined]
        return msgspec.json.Decoder(lines)


@dataclass(frozen=True)
class Unit(Generic[P]):
    """The smallest piece of work that is recorded.

    Attributes:
        key: which one.
        cluster: see `UnitRecord`.
        payload: what can be said of it before it is evaluated; recorded as it is where it fails.
    """

    key: UnitKey
    cluster: str
    payload: P

    def record(self, fingerprint: str, payload: P, **envelope: Any) -> UnitRecord[P]:
        """Its record: the envelope's fields as keywords (see `UnitRecord`)."""
        return UnitRecord(
            **self.key._asdict(), cluster=self.cluster, fingerprint=fingerprint, payload=payload, **envelope
        )

    def failed(self, reason: str, fingerprint: str = "", **envelope: Any) -> UnitRecord[P]:
        """Its record where there is no result."""
        return self.record(fingerprint, self.payload, failure=reason, **envelope)

    def excluded(self, reason: str, fingerprint: str, **envelope: Any) -> UnitRecord[P]:
        """Its record where it turns out, when its turn comes, that nobody could be evaluated on it."""
        return self.record(fingerprint, self.payload, excluded=reason, **envelope)
