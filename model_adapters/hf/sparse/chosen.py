"""Attention to keys that are chosen for each head while a chunk is encoded (MInference,
arXiv:2407.02490)."""

from collections.abc import Iterator
from functools import partial
from typing import Protocol

import torch
from torch import Tensor

from model_adapters.hf.sparse.interface import Plan, SeenBy
from model_adapters.hf.sparse.kernel import Keys, attend
from model_adapters.hf.sparse.layout import Layout
from model_adapters.options.attention import BlockSparse, VerticalSlash

_BLOCK = 64  # queries that are computed together, and keys of a block
_LAST = 64  # queries at the end of a chunk, by which columns and diagonals are chosen
# Chosen in any case, as published.
_FIRST_COLUMNS, _NEAR_DIAGONALS = 30, 100


class Choice(Protocol):
    """What heads chose for the queries of a chunk."""

    def places(self, head: int, at: int, end: int) -> Tensor:
        """Return the places of stored tokens that a query from `at` to `end` sees, (places,)."""

    def seen(self, head: int, at: int, end: int, places: Tensor) -> Tensor:
        """Return which of these each of them sees, as a mask that spreads to (queries, places)."""


class ChosenAttention:
    """Attention of chunks to chosen keys; queries of few tokens see everything.

    What is chosen goes by the whole chunk, so the length of chunks decides replies.
    """

    def __init__(self, shape: VerticalSlash | BlockSparse) -> None:
        self._shape = shape

    def plan(self, columns: Layout, _n_queries: int, seen: SeenBy) -> Plan:
        """See `WindowAttention.plan`."""
        return partial(self._attend, columns, seen)

    def _attend(
        self,
        columns: Layout,
        seen: SeenBy,
        _layer: int,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        scale: float | None,
    ) -> Tensor:
        n = query.shape[-2]
        rows = columns[len(columns) - n :]
        if n <= _LAST:
            return attend(query, Keys(key, value, seen(rows.number, columns.number)), scale)
        choice: Choice
        if isinstance(self._shape, VerticalSlash):
            last = rows[n - _LAST :]
            is_seen = seen(last.number, columns.number)
            choice = _Lines(self._shape.share, query, key, columns, is_seen, scale)
        else:
            choice = _Blocks(self._shape.n_blocks, query, key, columns)
        output = torch.empty_like(query)
        for at, end in _spans(n, _BLOCK):
            for head in range(query.shape[0] * query.shape[1]):
                group, within = divmod(head, query.shape[1])
                places = choice.places(head, at, end)
                places = places[places < len(columns) - n + end]
                may = seen(rows.number[at:end], columns.number[places])
                output[group, within, at:end] = attend(
                    query[group : group + 1, within : within + 1, at:end],
                    Keys(
                        key[group : group + 1, :, places],
                        value[group : group + 1, :, places],
                        may & choice.seen(head, at, end, places),
                    ),
                    scale,
                )
        return output


class _Lines:
    """Columns, and diagonals, whose scores by the last queries of a chunk are the largest."""

    def __init__(
        self,
        share: float,
        query: Tensor,
        key: Tensor,
        columns: Layout,
        seen: Tensor,
        scale: float | None,
    ) -> None:
        n_rows, n_columns = seen.shape
        self._n_queries = query.shape[-2]
        factor = query.shape[-1] ** -0.5 if scale is None else scale
        scores = query[..., -n_rows:, :] @ key.transpose(-1, -2) * factor
        weights = scores.float().masked_fill(~seen, -torch.inf).softmax(dim=-1).flatten(0, 1)
        n_chosen = max(1, round(share * n_columns))
        vertical = weights.sum(dim=1)  # (heads, stored)
        if bool((columns.first != columns.last).any()):
            vertical = _summed(vertical, columns.first)
        vertical[:, :_FIRST_COLUMNS] = torch.inf
        slash = _diagonals(weights)
        slash[:, :_NEAR_DIAGONALS] = torch.inf
        self._columns = _is_largest(vertical, n_chosen)
        self._diagonals = _is_largest(slash, n_chosen)

    def places(self, head: int, at: int, end: int) -> Tensor:
        """See `Choice`."""
        first, last = self._number(at), self._number(end - 1)
        # How many chosen diagonals are nearer than each distance.
        nearer = torch.nn.functional.pad(self._diagonals[head].cumsum(0), (1, 0))
        distance = last - torch.arange(len(nearer) - 1, device=nearer.device)  # from the last query
        n_on = nearer[(distance + 1).clamp(min=0)] - nearer[(distance - last + first).clamp(min=0)]
        return (self._columns[head] | (n_on > 0)).nonzero()[:, 0]

    def seen(self, head: int, at: int, end: int, places: Tensor) -> Tensor:
        """See `Choice`."""
        rows = torch.arange(self._number(at), self._number(end), device=places.device)
        distance = rows[:, None] - places
        on_diagonal = self._diagonals[head][distance.clamp(min=0)] & (distance >= 0)
        return self._columns[head][places] | on_diagonal

    def _number(self, query: int) -> int:
        return self._columns.shape[-1] - self._n_queries + query


class _Blocks:
    """Blocks of keys whose mean key fits the mean query of a block best, the queries' own too."""

    def __init__(self, n_blocks: int, query: Tensor, key: Tensor, columns: Layout) -> None:
        n = query.shape[-2]
        number = columns.number if torch.equal(columns.first, columns.last) else columns.first
        self._block_of = _blocks(number, len(columns))
        means = _means(key, self._block_of)  # (key heads, 1, blocks, head size)
        own = self._block_of[-n:]
        chosen = []
        for at, end in _spans(n, _BLOCK):
            pooled = query[..., at:end, :].mean(dim=-2, keepdim=True)
            scores = (pooled @ means.transpose(-1, -2))[..., 0, :].flatten(0, 1)
            scores[:, int(own[end - 1]) + 1 :] = -torch.inf
            scores[:, int(own[at]) : int(own[end - 1]) + 1] = torch.inf
            chosen.append(_is_largest(scores, n_blocks))
        self._chosen = chosen

    def places(self, head: int, at: int, end: int) -> Tensor:
        """See `Choice`."""
        return self._chosen[at // _BLOCK][head][self._block_of].nonzero()[:, 0]

    def seen(self, head: int, at: int, end: int, places: Tensor) -> Tensor:
        """See `Choice`."""
        return places.new_ones((), dtype=torch.bool)


def _spans(n: int, size: int) -> Iterator[tuple[int, int]]:
    for at in range(0, n, size):
        yield at, min(at + size, n)


def _is_largest(scores: Tensor, n: int) -> Tensor:
    """Return which are the n largest in each row, and all that are infinite; of equal ones the
    first."""
    order = scores.argsort(dim=-1, descending=True, stable=True)
    chosen = torch.zeros_like(scores, dtype=torch.bool)
    chosen.scatter_(-1, order[:, :n], True)
    return (chosen | scores.isposinf()) & ~scores.isneginf()


def _diagonals(weights: Tensor) -> Tensor:
    """Return the sum along each diagonal of the last rows, by its distance from the end: (heads,
    distances)."""
    n_rows, n_columns = weights.shape[-2:]
    reversed_rows = torch.nn.functional.pad(weights.flip(-1), (0, n_rows))
    total = torch.zeros_like(weights[:, 0])
    for row in range(n_rows):
        begin = n_rows - 1 - row
        total += reversed_rows[:, row, begin : begin + n_columns]
    return total


def _summed(scores: Tensor, groups: Tensor) -> Tensor:
    """Return for each column the sum of its group's, whose tokens are neighbours."""
    _, group, sizes = groups.unique_consecutive(return_inverse=True, return_counts=True)
    sums = scores.new_zeros(len(scores), len(sizes)).index_add_(1, group, scores)
    return sums[:, group]


def _blocks(number: Tensor, n: int) -> Tensor:
    """Return the block of each stored token: whole frames, and up to 64 tokens of text."""
    _, group, sizes = number.unique_consecutive(return_inverse=True, return_counts=True)
    begins = sizes > 1  # a frame
    begins[1:] |= sizes[:-1] > 1
    run = begins.cumsum(0)  # texts between frames have one number
    first = torch.searchsorted(run, run)
    within = torch.arange(len(run), device=run.device) - first
    block = (run * (n // _BLOCK + 1) + within // _BLOCK).unique_consecutive(return_inverse=True)[1]
    return block[group]


def _means(keys: Tensor, block_of: Tensor) -> Tensor:
    n_blocks = int(block_of[-1]) + 1
    sums = keys.new_zeros(*keys.shape[:-2], n_blocks, keys.shape[-1], dtype=torch.float32)
    sums.index_add_(-2, block_of, keys.float())
    return (sums / block_of.bincount(minlength=n_blocks)[:, None]).to(keys)
