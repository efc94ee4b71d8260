"""Adapters that are not this package's, behind a guard: what they raise and give is checked.

Whatever the code of others does on a request is a failure of this request, in one line: it raises
anything (`sys.exit` too), or gives no `Reply`, counts that are none, texts that no file can hold, a
generator without end.

To add or change what an adapter may give: here; the contract in words is `docs/own-models.md`.
"""

from collections.abc import Sequence
from typing import Any

import msgspec

from infthor_eval.errors import ModelError, in_one_line, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.quantities import Amount, Count
from infthor_eval.storage.digests import json_values
from model_adapters.protocols import (
    ArmDelta,
    Capabilities,
    Conversation,
    Decoding,
    Episode,
    FramePolicy,
    Mark,
    Model,
    Notice,
    Part,
    Policy,
    Reply,
    Role,
    Subject,
)
from model_adapters.refusals import wrap_adapter_errors, wrap_closing, wrap_request_errors


class _ReplyLimits(msgspec.Struct):
    """The fields of a `Reply` as a journal can hold them."""

    text: str
    n_reply_tokens: Count | None
    n_context_tokens: Count | None
    n_cached_tokens: Count | None
    token_ids: tuple[Count, ...] | None
    faults: tuple[str, ...]
    cost: Amount | None
    thinking: str | None
    n_watched: Count | None
    context_hash: str | None
    frames_hash: str | None
    margins: tuple[Amount, ...] | None
    seconds: Amount | None


def guard(name: str, adapter: Any) -> Model | Policy | FramePolicy:
    """Return an adapter behind a guard; it has all members of its protocol.

    Args:
        name: the name by which the user asked for it, for messages.
        adapter: a model, or a policy.
    """
    with wrap_adapter_errors(f"model {name}: its name or capabilities fail"):
        own_name = adapter.name
        capabilities = adapter.capabilities
    if not isinstance(own_name, str) or not own_name.strip():
        raise ModelError(f"model {name}: its name is {own_name!r:.60}; make it a text")
    if not isinstance(capabilities, Capabilities):
        given = f"{capabilities!r:.60}"
        raise ModelError(f"model {name}: its capabilities are {given}; make them Capabilities")
    kind: type[Any] = _GuardedPerson if hasattr(adapter, "tell") else _GuardedModel
    if hasattr(adapter, "act"):
        kind = _GuardedPolicy if hasattr(adapter, "begin") else _GuardedFramePolicy
    guarded: Model | Policy | FramePolicy = kind(own_name, capabilities, adapter)
    return guarded


def identity_of(subject: Subject) -> dict[str, Any]:
    """Return the identity of a subject, as JSON values.

    Raises:
        ModelError: it fails, or a value in it is none of JSON's; the message names the field.
    """
    with wrap_adapter_errors(f"{subject.name}: identity() fails"):
        identity = subject.identity()
    try:
        return dict(json_values(identity, "identity()"))
    except (TypeError, ValueError) as error:
        hint = "give numbers, texts, lists and dicts"
        raise ModelError(f"{subject.name}: {in_one_line(error)}; {hint}") from error


class _Guarded:
    """What is behind a guard; members beyond those of its protocol are its own."""

    def __init__(self, name: str, behind: Any) -> None:
        self._name = name
        self._behind = behind

    def __getattr__(self, name: str) -> Any:
        if name == "_behind":  # not there yet, while a copy is made
            raise AttributeError(name)
        return getattr(self._behind, name)

    def _call(self, method: str, *args: Any, **kwargs: Any) -> Any:
        """Return what a method returns; whatever it raises is a failure of the request."""
        with wrap_request_errors(self._name):
            return getattr(self._behind, method)(*args, **kwargs)


class _GuardedSubject(_Guarded):
    """What models and policies have in common."""

    def __init__(self, name: str, capabilities: Capabilities, adapter: Any) -> None:
        super().__init__(name, adapter)
        self.name = name
        self.capabilities = capabilities

    def identity(self) -> dict[str, Any]:
        """See `Subject`."""
        with wrap_adapter_errors(f"{self.name}: identity() fails"):
            identity: dict[str, Any] = self._behind.identity()
            return identity

    def close(self) -> None:
        """See `Subject`."""
        with wrap_closing(self.name):
            self._behind.close()


class _GuardedModel(_GuardedSubject):
    """See `Model`."""

    def tokens_per_frame(self, frame: FrameRef) -> int | None:
        """See `Model`."""
        count = self._call("tokens_per_frame", frame)
        return _require_count(self.name, "tokens_per_frame", count)

    def conversation(self) -> Conversation:
        """See `Model`."""
        return _GuardedConversation(self.name, self._call("conversation"))


class _GuardedPerson(_GuardedModel):
    """See `PersonModel`."""

    def show_notice(self, notice: Notice) -> None:
        """See `PersonModel`."""
        self._call("show_notice", notice)

    def show_position(self, number: int, n_units: int) -> None:
        """See `PersonModel`."""
        self._call("show_position", number, n_units)


class _GuardedConversation(_Guarded):
    """See `Conversation`."""

    @property
    def n_tokens(self) -> int | None:
        """See `Conversation`."""
        with wrap_request_errors(self._name):
            count = self._behind.n_tokens
        return _require_count(self._name, "n_tokens", count)

    def append(self, *parts: Part, role: Role = "user") -> None:
        """See `Conversation`."""
        self._call("append", *parts, role=role)

    def mark(self) -> Mark:
        """See `Conversation`."""
        mark: Mark = self._call("mark")
        return mark

    def rewind(self, mark: Mark) -> None:
        """See `Conversation`."""
        self._call("rewind", mark)

    def reply(self, decoding: Decoding) -> Reply:
        """See `Conversation`."""
        return _require_reply(self._name, self._call("reply", decoding))

    def replies(self, continuations: Sequence[Sequence[Part]], decoding: Decoding) -> list[Reply]:
        """See `Conversation`."""
        # A list of its own: the adapter may change what it is given.
        replies = self._call("replies", [list(parts) for parts in continuations], decoding)
        if not isinstance(replies, list | tuple) or len(replies) != len(continuations):
            raise ModelError(
                f"{self._name} gives {_in_words(replies)} for {len(continuations)} continuations; "
                "give a list with a Reply to each"
            )
        return [_require_reply(self._name, reply) for reply in replies]


class _GuardedPolicy(_GuardedSubject):
    """See `Policy`."""

    def begin(self, episode: Episode) -> None:
        """See `Policy`."""
        self._call("begin", episode)

    def act(self, *seen: Any) -> tuple[ArmDelta, ...]:
        """See `Policy`; what its steps hold is checked where they are executed."""
        chunk = self._call("act", *seen)
        if not isinstance(chunk, list | tuple):
            raise ModelError(
                f"{self.name} gives {_in_words(chunk)} for its next steps; give a tuple of ArmDelta"
            )
        return tuple(chunk)

    def end(self, *, success: bool | None) -> None:
        """See `Policy`."""
        self._call("end", success=success)


class _GuardedFramePolicy(_GuardedSubject):
    """See `FramePolicy`."""

    act = _GuardedPolicy.act

    def reset(self) -> None:
        """See `FramePolicy`."""
        self._call("reset")


def _require_reply(name: str, reply: Any) -> Reply:
    if not isinstance(reply, Reply):
        raise ModelError(
            f"{name} gives {_in_words(reply)} for a reply; write `return Reply(text)`, with `from "
            "model_adapters import Reply`"
        )
    # A ValueError is msgspec's, or of lone surrogates.
    problem = f"{name} gives a reply that cannot be kept"
    with wrap_errors(problem, "fix the adapter", catch=ValueError, raise_as=ModelError):
        checked = msgspec.convert(reply, _ReplyLimits, from_attributes=True)
        for text in (checked.text, checked.thinking or "", *checked.faults):
            text.encode()
    return reply


def _require_count(name: str, what: str, count: Any) -> int | None:
    problem = f"{name} gives {count!r:.60} for {what}"
    broken = msgspec.ValidationError
    with wrap_errors(problem, "fix the adapter", catch=broken, raise_as=ModelError):
        checked: int | None = msgspec.convert(count, Count | None)
    return checked


def _in_words(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"{len(value)} items"
    return "nothing" if value is None else f"a {type(value).__name__}"
