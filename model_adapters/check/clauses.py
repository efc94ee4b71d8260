"""What the checks share: clauses, their error, and the questions that are asked."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Generic, Protocol

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.digests import json_values
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.protocols import (
    Conversation,
    Decoding,
    FramePolicy,
    Model,
    Part,
    Policy,
    Reply,
)

NEW_TOKENS = 8
GREEDY = Decoding(max_new_tokens=NEW_TOKENS)
QUESTION = "\nQuestion: What do you see? Answer with a single word."


class ContractError(AssertionError):
    """An adapter violates a clause of its protocol; the message says which."""


def require(holds: bool, clause: str) -> None:
    """Raise `ContractError` with the clause unless it holds."""
    if not holds:
        raise ContractError(clause)


def raises(
    error_type: type[Exception], call: Callable[..., Any], *args: Any, **kwargs: Any
) -> bool:
    """Return whether a call raises an error of this type."""
    try:
        call(*args, **kwargs)
    except error_type:
        return True
    return False


def require_error(
    clause: str, error_type: type[Exception], call: Callable[..., Any], *args: Any, **kwargs: Any
) -> None:
    """Raise `ContractError` with the clause unless a call raises an error of this type."""
    require(raises(error_type, call, *args, **kwargs), clause)


def check_members(adapter: Any) -> None:
    """Check that a model and its conversation, or a policy, have all members of their protocols.

    An object with `act` counts as a policy, any other as a model.
    """
    if hasattr(adapter, "act"):
        _require_members(adapter, Policy if hasattr(adapter, "begin") else FramePolicy)
    else:
        _require_members(adapter, Model)
        _require_members(adapter.conversation(), Conversation)


def check_identity(adapter: Model | Policy | FramePolicy) -> None:
    """Check name, identity and capabilities; `ContractError` for a clause that does not hold."""
    check_identity_values(adapter.identity)
    require(bool(adapter.name), "the name is empty")
    require(adapter.capabilities.batch_size >= 1, "batch_size is below 1")
    require(adapter.capabilities.max_in_flight >= 1, "max_in_flight is below 1")


def check_identity_values(identify: Callable[[], Mapping[str, Any]]) -> None:
    """Check that an identity is the same each time, and JSON values."""
    identity = dict(identify())
    try:
        again = json_values(identity, "identity()")
    except ValueError as error:
        raise ContractError(str(error)) from error
    require(again == identity, "identity() changes when written as JSON and read back")
    require(dict(identify()) == identity, "identity() differs from call to call")


@contextmanager
def frames_of_one_colour(size: tuple[int, int]) -> Iterator[tuple[FrameRef, FrameRef]]:
    """Yield a black and a white frame of this width and height, with files in the context."""
    with ScratchFolder() as folder:
        black = folder / "black.png"
        white = folder / "white.png"
        for path in (black, white):
            Image.new("RGB", size, path.stem).save(path)
        yield FrameRef(black), FrameRef(white)


def _require_members(instance: object, protocol: type) -> None:
    """Raise `ContractError` if an object lacks members of a protocol; no property is evaluated."""
    bases = [base for base in protocol.__mro__ if base not in (Protocol, Generic, object)]
    names = {name for base in bases for name in vars(base) if not name.startswith("_")}
    missing = sorted(names - set(dir(instance)))
    require(
        not missing,
        f"{type(instance).__name__} lacks a member of {protocol.__name__}: {', '.join(missing)}",
    )


def start_conversation(model: Model, *parts: Part) -> Conversation:
    """Return a new conversation with a user turn of these parts."""
    conversation = model.conversation()
    conversation.append(*parts)
    return conversation


def ask(model: Model, *parts: Part, decoding: Decoding = GREEDY) -> Reply:
    """Return the reply to a user turn of these parts in a new conversation."""
    return start_conversation(model, *parts).reply(decoding)


def same_reply(one: Reply, other: Reply) -> bool:
    """Return whether text and token ids of two replies are equal."""
    return (one.text, one.token_ids) == (other.text, other.token_ids)


def require_same(
    model: Model, replies: Sequence[Reply], others: Iterable[Reply], clause: str
) -> None:
    """Raise `ContractError` with the clause unless replies equal others in order, which are asked
    for only if the model is deterministic."""
    if model.capabilities.deterministic:
        require(all(map(same_reply, replies, others)), clause)
