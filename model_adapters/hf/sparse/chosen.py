"""Attention to keys that are chosen for each head while a chunk is encoded (MInference,
arXiv:2407.02490)."""

from collections.abc import Iterator
from functools import partial

import torch
from torch import Tensor
from torch.nn.functional import pad, scaled_dot_product_attention

from model_adapters.hf.sparse.interface import Plan, SeenBy
from model_adapters.hf.sparse.kernel import Keys, attend
from model_adapters.hf.sparse.layout import Layout
from model_adapters.options.attention import BlockSparse, VerticalSlash

_BLOCK = 64  # queries that are computed together, keys of a block, and distances of a band
_LAST = 64  # queries at the end of a chunk, by which columns and bands are chosen
# Chosen in any case, as published: 30 columns, and 100 distances or more.
_FIRST_COLUMNS, _NEAR_BANDS = 30, 2


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
        choice: _Lines | _Blocks
        if isinstance(self._shape, VerticalSlash):
            last = rows[n - _LAST :]
            is_seen = seen(last.number, columns.number)
            choice = _Lines(self._shape.share, query, key, columns, is_seen, scale)
        else:
            choice = _Blocks(self._shape.n_blocks, query, key, columns)
        heads = torch.arange(query.shape[0], device=query.device)
        heads = heads.repeat_interleave(query.shape[1])[:, None]  # the key head of each head
        outputs = []
        for at, end in _spans(n, _BLOCK):
            places, chosen = choice.keys(at, end)
            may = seen(rows.number[at:end], columns.number[places]) & chosen
            outputs.append(
                scaled_dot_product_attention(
                    query[..., at:end, :].flatten(0, 1)[None],
                    key[heads, 0, places][None],
                    value[heads, 0, places][None],
                    attn_mask=may[None],
                    scale=scale,
                )
            )
        return torch.cat(outputs, dim=-2)[0].unflatten(0, query.shape[:2])


class _Lines:
    """Columns, and bands of diagonals, whose scores by the last queries of a chunk are largest."""

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
        self._before = n_columns - query.shape[-2]  # place of the first query
        factor = query.shape[-1] ** -0.5 if scale is None else scale
        last = (query[..., -n_rows:, :] * factor).flatten(1, 2)  # heads that share keys together
        scores = (last @ key[:, 0].transpose(-1, -2)).float().unflatten(1, (-1, n_rows))
        weights = scores.masked_fill_(~seen, -torch.inf).softmax(dim=-1).flatten(0, 1)
        vertical = weights.sum(dim=1)  # (heads, stored)
        if bool((columns.first != columns.last).any()):
            vertical = _summed(vertical, columns.first)
        vertical[:, :_FIRST_COLUMNS] = torch.inf
        self._columns = _largest(vertical, max(round(share * n_columns), _FIRST_COLUMNS))
        slash = _diagonals(weights)
        bands = pad(slash, (0, -n_columns % _BLOCK)).unflatten(-1, (-1, _BLOCK)).sum(dim=-1)
        bands[:, :_NEAR_BANDS] = torch.inf
        n_bands = max(round(share * n_columns / _BLOCK), _NEAR_BANDS)
        self._bands = _largest(bands, n_bands)  # (heads, chosen)
        self._is_column = torch.zeros_like(vertical, dtype=torch.bool)
        self._is_column.scatter_(-1, self._columns, True)

    def keys(self, at: int, end: int) -> tuple[Tensor, Tensor]:
        """Return what the queries from `at` to `end` see.

        Returns:
            Places of stored tokens, (heads, places), some of which stand for nothing, and which of
            them each query sees, as a mask that spreads to (heads, queries, places).
        """
        rows = torch.arange(at, end, device=self._bands.device) + self._before
        # A band of 64 distances, of 64 queries, is over 127 keys.
        offset = torch.arange(1 - _BLOCK, len(rows), device=rows.device)
        banded = (rows[0] - _BLOCK * self._bands)[..., None] + offset
        within = (rows - rows[0])[:, None] - offset  # distance within the band
        in_band = ((within >= 0) & (within < _BLOCK)).repeat(1, self._bands.shape[-1])
        places = banded.flatten(1)
        is_new = (places >= 0) & ~self._is_column.gather(-1, places.clamp(min=0))
        whole = is_new.new_ones(len(is_new), len(rows), self._columns.shape[-1])
        seen = torch.cat((whole, in_band & is_new[:, None]), dim=-1)
        return torch.cat((self._columns, places.clamp(min=0)), dim=-1), seen


class _Blocks:
    """Blocks of keys whose mean key fits the mean query of a block best, the queries' own too."""

    def __init__(self, n_blocks: int, query: Tensor, key: Tensor, columns: Layout) -> None:
        number = columns.number if torch.equal(columns.first, columns.last) else columns.first
        block_of = _blocks(number, len(columns))
        self._widths = block_of.bincount()
        self._begins = self._widths.cumsum(0) - self._widths
        means = _means(key, block_of)  # (key heads, 1, blocks, head size)
        own = block_of[-query.shape[-2] :]
        self._chosen = []
        for at, end in _spans(query.shape[-2], _BLOCK):
            pooled = query[..., at:end, :].mean(dim=-2, keepdim=True)
            scores = (pooled @ means.transpose(-1, -2))[..., 0, :].flatten(0, 1)
            first, last = int(own[at]), int(own[end - 1])
            scores[:, first : last + 1] = torch.inf
            n_chosen = min(max(n_blocks, last + 1 - first), last + 1)
            self._chosen.append(_largest(scores[:, : last + 1], n_chosen))

    def keys(self, at: int, end: int) -> tuple[Tensor, Tensor]:
        """See `_Lines.keys`."""
        chosen = self._chosen[at // _BLOCK]
        widths = self._widths[chosen]
        offset = torch.arange(int(widths.max()), device=chosen.device)
        within = offset < widths[..., None]
        places = torch.where(within, self._begins[chosen][..., None] + offset, 0)
        return places.flatten(1), within.flatten(1)[:, None]


def _spans(n: int, size: int) -> Iterator[tuple[int, int]]:
    for at in range(0, n, size):
        yield at, min(at + size, n)


def _largest(scores: Tensor, n: int) -> Tensor:
    """Return the places of the n largest of each row, ascending; of equal ones the first."""
    order = scores.argsort(dim=-1, descending=True, stable=True)
    return order[:, :n].sort(dim=-1).values


def _diagonals(weights: Tensor) -> Tensor:
    """Return the sum along each diagonal of the last rows, by its distance from the end: (heads,
    distances)."""
    n_heads, n_rows, n_columns = weights.shape
    # The last row first, each from its end on; row r of the view begins r places later.
    turned = pad(weights.flip(-1, -2), (0, n_rows))
    width = n_columns + n_rows
    skewed = turned.as_strided((n_heads, n_rows, n_columns), (n_rows * width, width + 1, 1))
    return skewed.sum(dim=1)


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
