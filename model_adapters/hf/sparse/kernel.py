"""Attention of some queries on some keys, and attention on two groups of keys as on one.

Queries, keys and values are (key heads, heads that share a key head, tokens, head size), with 1 as
the second size of keys and values. Masks are true where a query sees a key.
"""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention


class Keys(NamedTuple):
    """Keys and values, and which queries see them, (queries, keys)."""

    keys: Tensor
    values: Tensor
    seen: Tensor


def attend(query: Tensor, among: Keys, scale: float | None) -> Tensor:
    """Return the attention of queries, each of which sees a key at least; like `query`."""
    return scaled_dot_product_attention(
        query, *_shared(query, among), attn_mask=among.seen, scale=scale
    )


def attend_to_both(
    query: Tensor, among: Keys, turned: Tensor, others: Keys, scale: float | None
) -> Tensor:
    """Return the attention of queries on keys and on a few others, for which queries differ.

    Args:
        query: queries for the first keys, of which each sees one at least.
        among: these keys.
        turned: queries for the others.
        others: a few others.
        scale: factor of dot products; by the head size where None.
    """
    local, local_sum = _with_sum(query, among, scale)
    far, far_sum = _explicit(turned, others, scale)
    share = torch.sigmoid(far_sum - local_sum)[..., None].to(local.dtype)
    return torch.lerp(local, far.to(local.dtype), share)


def _with_sum(query: Tensor, among: Keys, scale: float | None) -> tuple[Tensor, Tensor]:
    """Return the attention and the logarithm of the sum of the scores' exponentials."""
    if query.device.type != "cpu":
        return _explicit(query, among, scale)
    bias = torch.zeros(among.seen.shape, dtype=query.dtype)
    bias.masked_fill_(~among.seen, -torch.inf)
    output, total = torch.ops.aten._scaled_dot_product_flash_attention_for_cpu(
        query, *_shared(query, among), attn_mask=bias[None, None], scale=scale
    )
    return output, total


def _explicit(query: Tensor, among: Keys, scale: float | None) -> tuple[Tensor, Tensor]:
    """Return the same where a query may see none: zeros and minus infinity."""
    factor = query.shape[-1] ** -0.5 if scale is None else scale
    scores = (query @ among.keys.transpose(-1, -2)).float() * factor
    scores = scores.masked_fill(~among.seen, -torch.inf)
    total = scores.logsumexp(dim=-1)
    weights = torch.where(among.seen, (scores - total[..., None]).exp(), 0.0)
    return weights.to(query.dtype) @ among.values, total


def _shared(query: Tensor, among: Keys) -> tuple[Tensor, Tensor]:
    """Return keys and values for each head, as views."""
    size = (-1, query.shape[1], -1, -1)
    return among.keys.expand(*size), among.values.expand(*size)
