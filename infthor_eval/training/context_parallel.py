"""Sequences that are too long for one process, cut over the ranks of a process group.

Positions are those of the whole sequence, features are put into their slots, and only then it is cut: so any family
can be cut that can be trained at all, Qwen2.5-VL with its three-axis positions too. The sequence is cut into two chunks
for each of N ranks, of which rank r holds chunks r and 2N - 1 - r: a chunk attends to all that is before it, so every
rank has the same work. In each layer keys and values of the whole sequence are gathered; queries, and all else that is
kept for the gradient, stay cut.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
import torch.distributed as dist
from torch import Tensor
from torch.nn.attention.bias import causal_lower_right
from torch.nn.functional import pad, scaled_dot_product_attention
from torch.utils.checkpoint import checkpoint
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import ModelError
from infthor_eval.training.batches import IGNORED, Batch
from infthor_eval.training.network import SequenceModel, next_labels
from model_adapters.hf.prompt import Frame

__all__ = ["ContextParallel", "Cut", "attend", "context_parallel"]

_ROWS = 256  # of a causal mask that exists at a time, where the kernel has to be given one
_HALF = (torch.float16, torch.bfloat16)


class Cut:
    """How a sequence is laid over ranks.

    Args:
        rank: whose share is meant.
        n_ranks: how many there are.

    Attributes:
        chunks: the numbers of the rank's two chunks of `2 * n_ranks`.
    """

    def __init__(self, rank: int, n_ranks: int) -> None:
        self._n_chunks = 2 * n_ranks
        self.chunks = (rank, self._n_chunks - 1 - rank)

    def share(self, whole: Tensor, padding: int | bool = 0) -> Tensor:
        """The rank's part of a tensor with the tokens on its last axis.

        Args:
            whole: (..., tokens).
            padding: what it is filled up with at the end, to chunks of equal length.

        Returns:
            (..., 2 * ceil(tokens / chunks)), its chunks one behind the other.
        """
        missing = -whole.shape[-1] % self._n_chunks
        chunks = pad(whole, (0, missing), value=padding).chunk(self._n_chunks, dim=-1)
        return torch.cat([chunks[number] for number in self.chunks], dim=-1)


class ContextParallel:
    """A model of which every rank computes its share of each sequence; made by `context_parallel`.

    Args:
        model: the same on every rank of the group.
        group: the ranks.
    """

    def __init__(self, model: SequenceModel, group: dist.ProcessGroup) -> None:
        self._model = model
        self._group = group
        self._rank, self._n_ranks = dist.get_rank(group), dist.get_world_size(group)
        self._cut = Cut(self._rank, self._n_ranks)

    def loss(self, batch: Batch, n_items: Tensor | int) -> Tensor:
        """This rank's summand of the loss; a gradient is whole when those of all ranks are added (`sum_gradients`).

        Every rank of the group has to call it, and its gradient's `backward`, for the same batches in the same order.

        Args:
            batch: one sequence.
            n_items: what the sum of the tokens' losses is divided by.

        Returns:
            A float32 scalar, 0 on a rank whose chunks have no label.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes, or the model attends in sliding
                windows.
        """
        if len(batch["input_ids"]) != 1:
            raise ValueError("ranks share one sequence at a time")
        embeds = self._embed(batch)
        positions = self._cut.share(batch["position_ids"])
        # The label of a chunk's last token is the first token of another chunk, so they move on before the cut.
        targets = self._cut.share(next_labels(batch["labels"]), IGNORED)
        total = self._model.loss_sum(self._model.decode(embeds, positions, None), targets)
        return total / torch.as_tensor(n_items, device=total.device)

    def _embed(self, batch: Batch) -> Tensor:
        slots = batch["slots"]
        own_slots = self._cut.share(slots, False)
        ids = self._cut.share(batch["input_ids"])
        if not batch["frames"]:
            return self._model.embed(ids, own_slots, [])
        rows = self._cut.share(slots.cumsum(-1) - 1)[own_slots]
        features = torch.cat(self._features(batch["frames"]))
        # A rank without any slot takes no row, and still hands on a gradient for the others' sake.
        return self._model.embed(ids, own_slots, [features[rows.to(features.device)]])

    def _features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Of each frame, (slots, hidden); every rank runs the vision tower on some of them."""
        distinct = list(dict.fromkeys(frames))
        shares = [distinct[rank :: self._n_ranks] for rank in range(self._n_ranks)]
        sizes = [[self._model.n_slots(frame) for frame in share] for share in shares]
        own = self._own_features(shares[self._rank], max(map(sum, sizes)))
        by_frame: dict[Frame, Tensor] = {}
        for share, lengths, features in zip(shares, sizes, _GatherStacked.apply(own, self._group), strict=True):
            pieces = features[: sum(lengths)].split(lengths)
            by_frame.update(zip(share, pieces, strict=True))
        return [by_frame[frame] for frame in frames]

    def _own_features(self, frames: Sequence[Frame], n_rows: int) -> Tensor:
        """Features of some frames one behind the other, filled up to a number of rows."""
        weight = self._model.model.get_input_embeddings().weight
        features = [piece.to(weight) for piece in self._model.features(frames)]
        own = torch.cat([weight.new_empty(0, weight.shape[1]), *features])
        own = pad(own, (0, 0, 0, n_rows - len(own)))
        # Where some ranks have a gradient to gather all have to take part, those without any frame too.
        return own.requires_grad_() if self._model.trains_vision and not own.requires_grad else own

    def attention(
        self,
        module: torch.nn.Module,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        attention_mask: Tensor | None,
        dropout: float = 0.0,
        scaling: float | None = None,
        sliding_window: int | None = None,
        **_: Any,
    ) -> tuple[Tensor, None]:
        """Attention as transformers' decoder layers call it: causal, of this rank's queries to the whole sequence.

        Args:
            module: the layer's attention.
            query: (batch, heads, own tokens, size of a head).
            key: (batch, heads of keys, own tokens, size of a head).
            value: like `key`.
            attention_mask: None.
            dropout: probability.
            scaling: of the products; by the size of a head where None.
            sliding_window: None.

        Returns:
            (batch, own tokens, heads, size of a head), and no weights.

        Raises:
            ModelError: the model attends in sliding windows.
        """
        if sliding_window is not None:
            raise ModelError(
                f"the model attends in windows of {sliding_window} tokens; a sequence can be cut over ranks only where "
                "attention is full"
            )
        keys, values = _GatherTokens.apply(torch.stack([key, value]), self._group)
        n_tokens = query.shape[-2] // 2
        outputs = [
            attend(own, keys[..., : end * n_tokens, :], values[..., : end * n_tokens, :], dropout, scaling)
            for own, end in zip(query.chunk(2, dim=-2), (number + 1 for number in self._cut.chunks), strict=True)
        ]
        return torch.cat(outputs, dim=-2).transpose(1, 2), None


@contextmanager
def context_parallel(model: SequenceModel, group: dist.ProcessGroup) -> Iterator[ContextParallel]:
    """Have the ranks of a group share sequences; the gradient has to be computed within the context, too.

    Args:
        model: the same on every rank of the group.
        group: the ranks.
    """
    parallel = ContextParallel(model, group)
    name = f"context_parallel_{id(parallel)}"
    config = model.decoder.config
    before = config._attn_implementation
    # As an attention that transformers makes no masks for: each would be of all tokens by all tokens. Put into the
    # dictionary and not registered, because what is registered cannot be taken back.
    ALL_ATTENTION_FUNCTIONS[name] = parallel.attention
    config._attn_implementation = name
    try:
        yield parallel
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[name]


def attend(query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None) -> Tensor:
    """Causal attention of the last tokens of a sequence to all of it.

    Args:
        query: (batch, heads, last tokens, size of a head).
        key: (batch, heads of keys, tokens, size of a head).
        value: like `key`.
        dropout: probability.
        scaling: of the products; by the size of a head where None.

    Returns:
        As `query`.
    """
    if query.is_cuda and query.dtype in _HALF:
        return _flash(query, key, value, dropout, scaling)
    # Other kernels have to be given a mask. It is made for some rows at a time, and again for the gradient.
    seen = key.shape[-2] - query.shape[-2]
    outputs = []
    for rows in query.split(_ROWS, dim=-2):
        seen += rows.shape[-2]
        outputs.append(
            checkpoint(_masked, rows, key[..., :seen, :], value[..., :seen, :], dropout, scaling, use_reentrant=False)
        )
    return torch.cat(outputs, dim=-2)


def _flash(query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None) -> Tensor:
    """By a kernel that aligns the causal mask with the last token by itself."""
    mask = causal_lower_right(query.shape[-2], key.shape[-2])
    grouped = query.shape[1] != key.shape[1]
    return scaled_dot_product_attention(query, key, value, mask, dropout, scale=scaling, enable_gqa=grouped)


def _masked(query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None) -> Tensor:
    n_rows, n_columns = query.shape[-2], key.shape[-2]
    mask = torch.ones(n_rows, n_columns, dtype=torch.bool, device=query.device).tril(n_columns - n_rows)
    n_groups = query.shape[1] // key.shape[1]
    key, value = (states.repeat_interleave(n_groups, dim=1) for states in (key, value))
    return scaled_dot_product_attention(query, key, value, mask, dropout, scale=scaling)


class _GatherTokens(torch.autograd.Function):
    """All ranks' chunks, in the order of the sequence; (..., tokens, size) from (..., own tokens, size)."""

    @staticmethod
    def forward(ctx: Any, own: Tensor, group: dist.ProcessGroup) -> Tensor:
        ctx.group = group
        heads, tails = _gather(own, group).chunk(2, dim=-2)
        return torch.cat([*heads, *reversed(tails.unbind())], dim=-2)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        n_ranks = dist.get_world_size(ctx.group)
        chunks = gradient.chunk(2 * n_ranks, dim=-2)
        shares = [torch.cat([chunks[rank], chunks[-1 - rank]], dim=-2) for rank in range(n_ranks)]
        return _sum_own(shares, ctx.group), None


class _GatherStacked(torch.autograd.Function):
    """All ranks' tensors, in the order of the ranks; (ranks, ...) from (...)."""

    @staticmethod
    def forward(ctx: Any, own: Tensor, group: dist.ProcessGroup) -> Tensor:
        ctx.group = group
        return _gather(own, group)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        return _sum_own(gradient.contiguous().unbind(), ctx.group), None


def _gather(own: Tensor, group: dist.ProcessGroup) -> Tensor:
    """(ranks, ...) from (...)."""
    gathered = own.new_empty(dist.get_world_size(group), *own.shape)
    dist.all_gather(list(gathered.unbind()), own.contiguous(), group=group)
    return gathered


def _sum_own(shares: Sequence[Tensor], group: dist.ProcessGroup) -> Tensor:
    """The sum of what all ranks have for this one; (...) from one (...) for each rank."""
    own = torch.empty_like(shares[0])
    dist.reduce_scatter(own, list(shares), group=group)
    return own
