"""Tokens of actions, one after the other, each the likeliest."""

from collections.abc import Callable, Sequence
from typing import Any

import torch

from infthor_eval.errors import ModelError

__all__ = ["embedded", "greedy"]


def embedded(model: Any, ids: Sequence[int]) -> torch.Tensor:
    """Embeddings of ids, (1, ids, hidden), as a transformers model feeds them to its first layer."""
    embedding = model.get_input_embeddings()
    found: torch.Tensor = embedding(torch.tensor([ids], device=embedding.weight.device))
    return found


def greedy(
    first: torch.Tensor, step: Callable[[int], torch.Tensor], legal: Sequence[range], *, constrained: bool
) -> list[int]:
    """Write tokens of actions.

    Args:
        first: logits of the first token, (vocabulary,).
        step: feeds a token and returns the logits of the next, (vocabulary,).
        legal: the ids that mean something at each place.
        constrained: choose among these; else among all, and clip to them, as the original implementations do. Every
            place is written either way: an end-of-text token ends nothing.

    Raises:
        ModelError: the logits are not numbers.
    """
    ids: list[int] = []
    logits = first
    for place, allowed in enumerate(legal):
        held = logits[allowed.start : allowed.stop] if constrained else logits
        if not torch.isfinite(held.max()):  # the largest is NaN where one is
            raise ModelError(f"action token {place + 1} has no finite score (NaN); try dtype=float32")
        token = int(held.argmax()) + (allowed.start if constrained else 0)
        ids.append(min(max(token, allowed.start), allowed.stop - 1))
        if place + 1 < len(legal):
            logits = step(token)
    return ids
