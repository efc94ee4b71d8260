"""Greedy decoding of action tokens."""

from collections.abc import Callable, Sequence
from typing import Any, cast

import torch

from infthor_eval.errors import ModelError


def embed_ids(model: Any, ids: Sequence[int]) -> torch.Tensor:
    """Return embeddings of ids, (1, ids, hidden), as input of a transformers model."""
    layer = model.get_input_embeddings()
    return cast(torch.Tensor, layer(torch.tensor([ids], device=layer.weight.device)))


def decode_greedily(
    first: torch.Tensor,
    step: Callable[[int], torch.Tensor],
    action_ids: Sequence[range],
    *,
    constrained: bool,
) -> list[int]:
    """Decode action tokens, each the most likely one.

    Args:
        first: logits of the first token, (vocabulary,).
        step: feeds a token and returns the logits of the next, (vocabulary,).
        action_ids: ids that encode an action at each place of the sequence.
        constrained: choose among these ids only. If false, choose among all ids and clip, as the
            original implementations do. All places are decoded in either case: an end-of-text token
            does not end the sequence.
    """
    ids: list[int] = []
    logits = first
    for position, allowed in enumerate(action_ids):
        scores = logits[allowed.start : allowed.stop] if constrained else logits
        if not torch.isfinite(scores.max()):  # the maximum is NaN if any score is
            raise ModelError(
                f"action token {position + 1} has no finite score (NaN); try dtype=float32"
            )
        token = int(scores.argmax()) + (allowed.start if constrained else 0)
        # The model is fed the token without clipping.
        ids.append(min(max(token, allowed.start), allowed.stop - 1))
        if position + 1 < len(action_ids):
            logits = step(token)
    return ids
