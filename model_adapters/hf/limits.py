"""What does not fit, in one line."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

import torch

from infthor_eval.errors import ModelError, wrap_errors

__all__ = ["check_limit", "naming_memory_errors", "naming_model_errors"]


# What torch and image processors raise on a request that does not suit them.
_FAILURES = (RuntimeError, ValueError, IndexError, ArithmeticError, MemoryError)


def check_limit(name: str, n_context: int, max_new_tokens: int, limit: int | None, option: str = "max_tokens") -> None:
    """Refuse what does not fit.

    Args:
        name: of the model.
        n_context: tokens of the context.
        max_new_tokens: most of the reply.
        limit: of both together; None for none.
        option: the model's, that sets the limit.

    Raises:
        ModelError: context and reply are beyond the limit.
    """
    if limit is not None and n_context + max_new_tokens > limit:
        raise ModelError(
            f"a context of {n_context} tokens and {max_new_tokens} new ones is beyond the {limit} tokens "
            f"of {name}; use fewer frames, or set {option} if the model can take more"
        )


@contextmanager
def naming_model_errors(name: str) -> Iterator[None]:
    """Turn what a model or its processor says to one request into one line, so that the others are answered.

    Raises:
        ModelError: it failed on the request.
    """
    with wrap_errors(
        f"{name} fails on the request", "ask otherwise, or report it", catch=_FAILURES, raise_as=ModelError
    ):
        yield


@contextmanager
def naming_memory_errors(name: str, n_context: int) -> Iterator[None]:
    """Turn errors of memory into one line with the size of the context.

    Whoever keeps the error keeps no tensors with it: what is asked next finds the memory free.

    Raises:
        ModelError: memory ran out.
    """
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        traceback.clear_frames(error.__traceback__)  # their variables hold the request's cache and activations
        # torch has an exception of its own for GPUs only; on CPU the allocator's name in the message tells.
        cpu = isinstance(error, MemoryError) or "DefaultCPUAllocator" in str(error)
        if not (cpu or isinstance(error, torch.OutOfMemoryError)):
            raise
        mend = "use fewer frames, kv_offload=true, or a smaller chunk_tokens"
        raise ModelError(f"out of memory on a context of {n_context} tokens ({name}); {mend}") from error
