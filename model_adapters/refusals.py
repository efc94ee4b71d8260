"""Checks of requests, with the same messages for every model."""

from collections.abc import Sequence
from contextlib import AbstractContextManager

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.protocols import Capabilities, Decoding, Turn

__all__ = ["check_decoding", "check_turns", "wrap_request_errors"]

_FAILURES = (RuntimeError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, OSError, MemoryError)


def check_decoding(name: str, capabilities: Capabilities, decoding: Decoding) -> None:
    """Check that the model supports this way of decoding.

    Args:
        name: name of the model, for the message.
        capabilities: capabilities of the model.
        decoding: the requested decoding.

    Raises:
        ModelError: the model does not sample, or cannot be restricted to choices.
    """
    if not (decoding.greedy or capabilities.sampling):
        raise ModelError(
            f"{name} decodes greedily only, not at temperature {decoding.temperature}; ask at temperature 0"
        )
    if decoding.choices and not capabilities.choices:
        raise ModelError(f"{name} does not support choices ({len(decoding.choices)} given); ask without choices")


def check_turns(name: str, turns: Sequence[Turn]) -> None:
    """Check that it is the model's turn.

    Args:
        name: name of the model, for the message.
        turns: turns of the conversation.

    Raises:
        ModelError: the conversation is empty, or its last turn is not the user's.
    """
    if not turns or turns[-1].role != "user":
        state = f"the last turn is the {turns[-1].role}'s" if turns else "the conversation is empty"
        raise ModelError(f"{name} has nothing to reply to: {state}; append a user turn")


def wrap_request_errors(name: str) -> AbstractContextManager[None]:
    """Turns what an adapter, anybody's, raises on a request into a failure of that request: the others go on.

    Args:
        name: of the model, for the message.
    """
    return wrap_errors(f"{name} fails on the request", "report it to who made it", catch=_FAILURES, raise_as=ModelError)
