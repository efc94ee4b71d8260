"""Attention under any mask and at any distances, one pair of tokens after the other."""

from collections.abc import Callable

import torch
from torch import Tensor

__all__ = ["FREQUENCIES", "attend_densely", "rotate"]

FREQUENCIES = torch.tensor([1.0, 0.25, 0.03])


def rotate(states: Tensor, positions: Tensor) -> Tensor:
    """Queries or keys, (..., tokens, 8), of which the first six values turn by positions."""
    angles = positions[:, None].double() * FREQUENCIES.double()
    turns = torch.polar(torch.ones_like(angles), angles)
    pairs = torch.complex(states[..., :3].double(), states[..., 3:6].double()) * turns
    return torch.cat((pairs.real, pairs.imag, states[..., 6:].double()), dim=-1).to(states)


def attend_densely(
    query: Tensor, key: Tensor, value: Tensor, distance: Callable[[int, int], float | None]
) -> Tensor:
    """Attention of unturned queries, (heads, tokens, 8), on unturned keys of as many heads.

    `distance` is how far behind a query a key is, and None if it is not seen.
    """
    n_heads, n_queries, size = query.shape
    n_keys = key.shape[-2]
    output = torch.zeros(n_heads, n_queries, value.shape[-1])
    for row in range(n_queries):
        number = n_keys - n_queries + row
        far = [distance(number, column) for column in range(n_keys)]
        seen = [column for column, at in enumerate(far) if at is not None]
        turned = rotate(key[:, seen], -torch.tensor([far[column] for column in seen]))
        scores = (turned @ query[:, row, :, None])[..., 0] * size**-0.5
        output[:, row] = (scores.softmax(-1)[:, None] @ value[:, seen])[:, 0]
    return output
