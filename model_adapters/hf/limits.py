"""Errors of models on single requests, as one line each."""

import traceback
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

import torch

from infthor_eval.errors import ModelError, wrap_errors

# Errors that torch and image processors raise on unsuitable input.
_FAILURES = (RuntimeError, ValueError, IndexError, ArithmeticError, MemoryError)


def check_limit(
    name: str, n_context: int, max_new_tokens: int, limit: int | None, option: str = "max_tokens"
) -> None:
    """Check that context and reply, in tokens, are within their common limit; None for none.

    `option` is the model's option that sets the limit, for the message.
    """
    if limit is not None and n_context + max_new_tokens > limit:
        raise ModelError(
            f"a context of {n_context} tokens and {max_new_tokens} new ones is beyond the {limit} "
            f"tokens of {name}; use fewer frames or less text, or set {option} if the model can "
            "take more"
        )


def wrap_model_errors(name: str) -> AbstractContextManager[None]:
    """Turn a model's or its processor's error on a request into one line, so that the run goes
    on."""
    problem = f"{name} fails on the request"
    hint = "change the request, or report it"
    return wrap_errors(problem, hint, catch=_FAILURES, raise_as=ModelError)


@contextmanager
def wrap_memory_errors(name: str, n_context: int) -> Iterator[None]:
    """Turn a lack of memory into one line with the size of the context.

    The error keeps no tensors alive, so their memory is free for the next request.
    """
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        # Its local variables hold the request's cache and activations.
        traceback.clear_frames(error.__traceback__)
        # torch has its own exception for GPUs only; on the CPU, only the allocator's name
        # identifies the error.
        cpu = isinstance(error, MemoryError) or "DefaultCPUAllocator" in str(error)
        if not (cpu or isinstance(error, torch.OutOfMemoryError)):
            raise
        hint = "use fewer frames, kv_offload=true, or a smaller chunk_tokens"
        raise ModelError(
            f"out of memory on a context of {n_context} tokens ({name}); {hint}"
        ) from error
