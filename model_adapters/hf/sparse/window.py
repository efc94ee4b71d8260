"""Attention to the first tokens and the last ones (LM-Infinite, arXiv:2308.16137; StreamingLLM,
arXiv:2309.17453)."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from model_adapters.hf.sparse.interface import Plan, SeenBy, by_mask
from model_adapters.hf.sparse.kernel import Keys, attend_to_both
from model_adapters.hf.sparse.layout import Layout
from model_adapters.hf.sparse.rotation import Rotation
from model_adapters.options.attention import Window

_BLOCK = 256  # queries that are computed together


@dataclass(frozen=True)
class WindowAttention:
    """Which tokens see which, and where the first ones seem to be.

    A token sees `sinks` first tokens and the `window` last ones, itself among them. With frames as
    a whole, a frame is seen if all of it is among these; a token sees its own frame in any case.

    Attributes:
        shape: sizes.
        positions: where a token sees the first ones that are out of its window: "ceiling": all as
            far as the window is long; "cache": right before the window; "absolute": where they are.
        rotations: how each layer turns to positions; empty with absolute ones.
    """

    shape: Window
    positions: str = "absolute"
    rotations: Sequence[Rotation] = ()

    def n_sinks(self, layout: Layout) -> int:
        """Return how many of the stored tokens are first ones, which are stored first."""
        return int((layout.last < self.shape.sinks).sum())

    def n_unseen(self, layout: Layout, number: int) -> int:
        """Return how many tokens behind the first ones no token from a number on sees."""
        is_out = number - layout.first >= self.shape.window
        return int((is_out & (layout.last >= self.shape.sinks)).sum())

    def first_seen(self, layout: Layout) -> int:
        """Return behind how many tokens a sequence can be cut, at least, so that later ones see
        what they must; 0 if nothing was dropped."""
        n_sinks = self.n_sinks(layout)
        if len(layout) == n_sinks or int(layout.number[n_sinks]) == n_sinks:
            return 0
        return int(layout.first[n_sinks]) + self.shape.window - 1

    def plan(self, columns: Layout, n_queries: int, seen: SeenBy) -> Plan:
        """Return the attention of the last of the stored tokens, in order; see `Plan`.

        What none of a block of queries sees is not computed.
        """
        rows = columns[len(columns) - n_queries :]
        n_sinks = self.n_sinks(columns)
        parts = []
        for at in range(0, n_queries, _BLOCK):
            block = rows[at : at + _BLOCK]
            oldest = min(int(block.number[0]) - self.shape.window + 1, int(block.first[0]))
            begin = max(int(torch.searchsorted(columns.first, oldest)), n_sinks)
            end = len(columns) - n_queries + at + len(block)
            places = _joined(n_sinks, begin, end, columns.number.device)
            among = columns[places]
            parts.append((places, self.part(block, among, seen(block.number, among.number))))

        def attend_in_order(
            layer: int, query: Tensor, key: Tensor, value: Tensor, scale: float | None
        ) -> Tensor:
            outputs = [
                part(layer, queries, key[..., places, :], value[..., places, :], scale)
                for (places, part), queries in zip(parts, query.split(_BLOCK, -2), strict=True)
            ]
            return torch.cat(outputs, dim=-2)

        return attend_in_order

    def part(self, rows: Layout, columns: Layout, seen: Tensor) -> Plan:
        """Return the attention of some queries on some stored tokens.

        Args:
            rows: layout of the queries.
            columns: layout of the stored tokens, with all first ones before others.
            seen: which of them each query may see by the model's own rule, (queries, stored).
        """
        near = self._near(rows, columns) & seen
        n_sinks = self.n_sinks(columns)
        far = seen[:, :n_sinks] & ~near[:, :n_sinks]
        if self.positions == "absolute" or not bool(far.any()):
            near[:, :n_sinks] |= far
            return by_mask(near)
        begins = columns.position[near.int().argmax(dim=-1)]  # of each query's window
        if self.positions == "ceiling":
            query_moves = self.shape.window - rows.position
            sink_moves = -columns.position[:n_sinks]
        else:
            query_moves = -(begins - columns.behind[n_sinks - 1]).clamp(min=0)
            sink_moves = torch.zeros_like(columns.position[:n_sinks])

        def attend_turned(
            layer: int, query: Tensor, key: Tensor, value: Tensor, scale: float | None
        ) -> Tensor:
            rotation = self.rotations[layer]
            sinks = rotation.turn(key[..., :n_sinks, :], sink_moves)
            others = Keys(sinks, value[..., :n_sinks, :], far)
            turned = rotation.turn(query, query_moves)
            return attend_to_both(query, Keys(key, value, near), turned, others, scale)

        return attend_turned

    def _near(self, rows: Layout, columns: Layout) -> Tensor:
        distance = rows.number[:, None] - columns.first
        return (distance < self.shape.window) | (columns.first == rows.first[:, None])


def _joined(n_first: int, begin: int, end: int, device: torch.device) -> slice | Tensor:
    """Return the places of the first tokens and of those from `begin` to `end`."""
    if begin == n_first:
        return slice(0, end)
    first = torch.arange(n_first, device=device)
    return torch.cat((first, torch.arange(begin, end, device=device)))
