"""Context parallelism: sequences too long for one process, split over ranks of a process group.

Positions are computed for the whole sequence and features are put into their slots before it is
split. So every family that can be trained can be split, including Qwen2.5-VL with its three-axis
positions. Each sequence is split into 2N chunks for N ranks, and rank r has chunks r and 2N - 1 -
r: attention of a chunk costs more the later it is, so this gives every rank the same work. In each
layer keys and values of the whole sequence are gathered; queries, and all other activations that
are kept for the gradient, stay split.
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
from model_adapters.hf.prompting.prompt import Frame

_MASK_ROWS = 256  # rows of an explicit causal mask that exist at a time
_HALF = (torch.float16, torch.bfloat16)


class SequenceSplit:
    """Assignment of a sequence's chunks to a rank.

    Attributes:
        chunks: numbers of the rank's two chunks of `2 * n_ranks`.
    """

    def __init__(self, rank: int, n_ranks: int) -> None:
        self._n_chunks = 2 * n_ranks
        self.chunks = (rank, self._n_chunks - 1 - rank)

    def local_part(self, whole: Tensor, padding: int | bool = 0) -> Tensor:
        """Return the rank's part of a tensor with tokens on its last axis.

        Args:
            whole: values of all tokens, (..., tokens).
            padding: value that is appended to make chunks of equal length.

        Returns:
            The rank's two chunks, concatenated, (..., 2 * ceil(tokens / chunks)).
        """
        missing = -whole.shape[-1] % self._n_chunks
        chunks = pad(whole, (0, missing), value=padding).chunk(self._n_chunks, dim=-1)
        return torch.cat([chunks[number] for number in self.chunks], dim=-1)


class ContextParallel:
    """A model that every rank runs on its part of each sequence; see `context_parallel`."""

    def __init__(self, model: SequenceModel, group: dist.ProcessGroup) -> None:
        self._model = model
        self._group = group
        self._rank, self._n_ranks = dist.get_rank(group), dist.get_world_size(group)
        self._split = SequenceSplit(self._rank, self._n_ranks)

    def loss(self, batch: Batch, n_items: Tensor | int) -> Tensor:
        """Return this rank's part of the loss; the gradients of all ranks have to be added
        (`sum_gradients`).

        Every rank of the group has to call this, and `backward` of the result, for the same batches
        in the same order: both communicate.

        Args:
            batch: one sequence.
            n_items: divisor of the sum of the tokens' losses.

        Returns:
            A float32 scalar, 0 on a rank whose chunks have no labels.
        """
        if len(batch["input_ids"]) != 1:
            raise ValueError("ranks share one sequence at a time")
        embeds = self._embed(batch)
        positions = self._split.local_part(batch["position_ids"])
        # The label of a chunk's last token is the first token of another chunk, so labels are
        # shifted before the split.
        targets = self._split.local_part(next_labels(batch["labels"]), IGNORED)
        total = self._model.loss_sum(self._model.decode(embeds, positions, None), targets)
        return total / torch.as_tensor(n_items, device=total.device)

    def _embed(self, batch: Batch) -> Tensor:
        slots = batch["slots"]
        own_slots = self._split.local_part(slots, False)
        ids = self._split.local_part(batch["input_ids"])
        if not batch["frames"]:
            return self._model.embed(ids, own_slots, [])
        rows = self._split.local_part(slots.cumsum(-1) - 1)[own_slots]
        features = torch.cat(self._features(batch["frames"]))
        # A rank without slots uses no row, but its backward pass has to take part in the gathering
        # of gradients.
        return self._model.embed(ids, own_slots, [features[rows.to(features.device)]])

    def _features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Return each frame's features, (slots, hidden); every rank computes those of some."""
        distinct = list(dict.fromkeys(frames))
        shares = [distinct[rank :: self._n_ranks] for rank in range(self._n_ranks)]
        sizes = [list(map(self._model.n_slots, share)) for share in shares]
        own = self._own_features(shares[self._rank], max(map(sum, sizes)))
        by_frame: dict[Frame, Tensor] = {}
        for share, lengths, features in zip(
            shares, sizes, _GatherStacked.apply(own, self._group), strict=True
        ):
            pieces = features[: sum(lengths)].split(lengths)
            by_frame.update(zip(share, pieces, strict=True))
        return [by_frame[frame] for frame in frames]

    def _own_features(self, frames: Sequence[Frame], n_rows: int) -> Tensor:
        """Return the concatenated features of some frames, padded to a number of rows."""
        weight = self._model.model.get_input_embeddings().weight
        features = [piece.to(weight) for piece in self._model.features(frames)]
        own = torch.cat([weight.new_empty(0, weight.shape[1]), *features])
        own = pad(own, (0, 0, 0, n_rows - len(own)))
        # If any rank has gradients to gather, all have to take part, including those without
        # frames.
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
        """Compute causal attention of this rank's queries to the whole sequence, as a transformers
        attention function.

        Args:
            module: attention module of the layer.
            query: queries, (batch, heads, own tokens, head size).
            key: keys, (batch, key heads, own tokens, head size).
            value: values, like `key`.
            attention_mask: None.
            dropout: dropout probability.
            scaling: factor of the dot products; by the head size where None.
            sliding_window: None.

        Returns:
            The outputs, (batch, own tokens, heads, head size), and None instead of weights.
        """
        if sliding_window is not None:
            raise ModelError(
                f"the model attends in windows of {sliding_window} tokens; context parallelism "
                "needs full attention: set parallel.context to 1"
            )
        keys, values = _GatherTokens.apply(torch.stack([key, value]), self._group)
        n_tokens = query.shape[-2] // 2
        outputs = []
        for own, number in zip(query.chunk(2, dim=-2), self._split.chunks, strict=True):
            end = (number + 1) * n_tokens
            outputs.append(
                causal_attention(own, keys[..., :end, :], values[..., :end, :], dropout, scaling)
            )
        return torch.cat(outputs, dim=-2).transpose(1, 2), None


@contextmanager
def context_parallel(model: SequenceModel, group: dist.ProcessGroup) -> Iterator[ContextParallel]:
    """Split sequences over the ranks of a group, with the same model on each; run the backward pass
    within, too."""
    parallel = ContextParallel(model, group)
    name = f"context_parallel_{id(parallel)}"
    config = model.decoder.config
    before = config._attn_implementation
    # transformers creates no mask for an unknown attention name; a mask would have all tokens by
    # all tokens. The function is put into the dictionary directly, because a registered one cannot
    # be removed.
    ALL_ATTENTION_FUNCTIONS[name] = parallel.attention
    config._attn_implementation = name
    try:
        yield parallel
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[name]


def causal_attention(
    query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None
) -> Tensor:
    """Return causal attention of a sequence's last tokens to all, in the shape of the queries.

    Args:
        query: queries of the last tokens, (batch, heads, last tokens, head size).
        key: keys of all tokens, (batch, key heads, tokens, head size).
        value: values of all tokens, like `key`.
        dropout: dropout probability.
        scaling: factor of the dot products; by the head size where None.
    """
    if query.is_cuda and query.dtype in _HALF:
        return _flash_attention(query, key, value, dropout, scaling)
    # Other kernels need an explicit mask. It is created for some rows at a time, and again for the
    # gradient.
    n_keys = key.shape[-2] - query.shape[-2]
    outputs = []
    for rows in query.split(_MASK_ROWS, dim=-2):
        n_keys += rows.shape[-2]
        states = key[..., :n_keys, :], value[..., :n_keys, :]
        outputs.append(
            checkpoint(_masked_attention, rows, *states, dropout, scaling, use_reentrant=False)
        )
    return torch.cat(outputs, dim=-2)


def _flash_attention(
    query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None
) -> Tensor:
    """Use a kernel that aligns the causal mask with the last token."""
    mask = causal_lower_right(query.shape[-2], key.shape[-2])
    grouped = query.shape[1] != key.shape[1]
    return scaled_dot_product_attention(
        query, key, value, mask, dropout, scale=scaling, enable_gqa=grouped
    )


def _masked_attention(
    query: Tensor, key: Tensor, value: Tensor, dropout: float, scaling: float | None
) -> Tensor:
    n_rows = query.shape[-2]
    n_columns = key.shape[-2]
    mask = torch.ones(n_rows, n_columns, dtype=torch.bool, device=query.device).tril(
        n_columns - n_rows
    )
    n_groups = query.shape[1] // key.shape[1]
    key = key.repeat_interleave(n_groups, dim=1)
    value = value.repeat_interleave(n_groups, dim=1)
    return scaled_dot_product_attention(query, key, value, mask, dropout, scale=scaling)


class _GatherTokens(torch.autograd.Function):
    """Gathers all ranks' chunks in the order of the sequence: (..., own tokens, size) to (...,
    tokens, size)."""

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
    """Stacks all ranks' tensors: (...) to (ranks, ...)."""

    @staticmethod
    def forward(ctx: Any, own: Tensor, group: dist.ProcessGroup) -> Tensor:
        ctx.group = group
        return _gather(own, group)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        return _sum_own(gradient.contiguous().unbind(), ctx.group), None


def _gather(own: Tensor, group: dist.ProcessGroup) -> Tensor:
    """Stack all ranks' tensors: (...) to (ranks, ...)."""
    gathered = own.new_empty(dist.get_world_size(group), *own.shape)
    dist.all_gather(list(gathered.unbind()), own.contiguous(), group=group)
    return gathered


def _sum_own(shares: Sequence[Tensor], group: dist.ProcessGroup) -> Tensor:
    """Return the sum of all ranks' tensors for this rank: one (...) for each rank to (...)."""
    own = torch.empty_like(shares[0])
    dist.reduce_scatter(own, list(shares), group=group)
    return own
