"""Attention of one's own in a decoder of transformers, by its interface, for a while."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import torch
from torch import Tensor
from transformers.masking_utils import AttentionMaskInterface
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import ModelError
from model_adapters.hf.sparse.kernel import Keys, attend

_NOT_COMPUTED = ("softcap", "s_aux", "position_bias")  # what some models add to the scores
# Whether a token sees another, by batch, head and both numbers in the sequence.
MaskFunction = Callable[[Tensor, Tensor, Tensor, Tensor], Tensor]
# Whether tokens of these numbers see those of others, (queries, keys), or by head.
SeenBy = Callable[[Tensor, Tensor], Tensor]


class Plan(Protocol):
    """Attention of given queries on given keys, in each layer."""

    def __call__(
        self, layer: int, query: Tensor, key: Tensor, value: Tensor, scale: float | None, /
    ) -> Tensor:
        """Return the attention; like `query`.

        Args:
            layer: number of the layer.
            query: (key heads, heads that share one, queries, head size).
            key, value: (key heads, 1, stored tokens, head size).
            scale: factor of dot products; by the head size where None.
        """


# Attention by a mask's rule, and by its window or chunk in tokens, None without.
PlanMaker = Callable[[MaskFunction, int | None], Plan]


class CannotAttendError(ModelError):
    """A model attends in a way that cannot be taken the place of."""


class _Planned:
    """Attention and masks by plans, in the form of transformers' functions."""

    def __init__(self, device: torch.device, plan: PlanMaker, hint: str) -> None:
        self._device = device
        self._plan = plan
        self._hint = hint
        self._plans: list[Plan] = []
        self._n_calls = 0

    def mask(
        self,
        *,
        mask_function: MaskFunction,
        use_vmap: bool = False,
        local_size: int | None = None,
        **_sizes: Any,
    ) -> Tensor:
        """Return the number of a plan, in place of a mask as long as the context."""
        if use_vmap:
            raise CannotAttendError(f"the model adds rules of its own to masks; {self._hint}")
        self._plans.append(self._plan(mask_function, local_size))
        return torch.full((1, 1, 1, 1), len(self._plans) - 1, device=self._device)

    def attention(
        self,
        module: Any,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        attention_mask: Tensor | None,
        *,
        scaling: float | None = None,
        **others: Any,
    ) -> tuple[Tensor, None]:
        """Return the outputs, (1, new tokens, heads, head size), of queries, (1, heads, new tokens,
        head size), on keys and values, (1, key heads, stored tokens, head size)."""
        self._n_calls += 1
        added = [name for name in _NOT_COMPUTED if others.get(name) is not None]
        if added:
            raise CannotAttendError(f"the model's attention has {added[0]}; {self._hint}")
        if attention_mask is None or attention_mask.dtype != torch.long:
            raise CannotAttendError(
                f"the model's masks are not all made by transformers' functions; {self._hint}"
            )
        # Heads that share keys become the second axis, along which a view repeats keys.
        queries = query[0].unflatten(0, (key.shape[1], -1))
        attend_by = self._plans[int(attention_mask)]
        output = attend_by(module.layer_idx, queries, key[0, :, None], value[0, :, None], scaling)
        return output.flatten(0, 1).transpose(0, 1)[None], None

    def require_layers(self, n_layers: int) -> None:
        """Raise CannotAttendError unless all layers were given attention, each as often."""
        if self._n_calls == 0 or self._n_calls % n_layers:
            raise CannotAttendError(
                f"the model's layers do not all attend by transformers' interface; {self._hint}"
            )


@contextmanager
def attending(config: Any, device: torch.device, plan: PlanMaker, hint: str) -> Iterator[None]:
    """Let a decoder attend by plans within the context, in which it is run.

    Args:
        config: config of the decoder.
        device: device of its inputs.
        plan: makes the attention of the layers of one mask, each time that the decoder is run.
        hint: what to do where the model does not allow it.

    Raises:
        CannotAttendError: the decoder has layers that do not attend by transformers' interface,
            that add something to the scores, or with masks that are not made by transformers'
            functions of positions.
    """
    planned = _Planned(device, plan, hint)
    before = config._attn_implementation
    name = f"plans_{id(planned)}"
    # The functions are put into the dictionaries directly, because registered ones cannot be
    # removed; transformers looks for masks in that of the class.
    masks = AttentionMaskInterface._global_mapping
    ALL_ATTENTION_FUNCTIONS[name] = planned.attention
    masks[name] = planned.mask
    config._attn_implementation = name
    try:
        yield
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[name], masks[name]
    planned.require_layers(config.num_hidden_layers)


def by_mask(seen: Tensor) -> Plan:
    """Return dense attention of queries, each of which sees a key at least, under a mask of
    (queries, stored tokens)."""

    def attend_by(
        _layer: int, query: Tensor, key: Tensor, value: Tensor, scale: float | None
    ) -> Tensor:
        # A model can be on several devices.
        return attend(query, Keys(key, value, seen.to(query.device)), scale)

    return attend_by


def seen_by(mask_function: MaskFunction, rows: Tensor, columns: Tensor) -> Tensor:
    """Return which tokens see which by a model's rule of numbers.

    Args:
        mask_function: the rule.
        rows: numbers, (rows,).
        columns: numbers, (columns,), or of each head, (heads, columns).

    Returns:
        (rows, columns), or (heads, rows, columns).
    """
    first = rows.new_zeros(1, 1, 1, 1)  # the only batch, and any head
    listed = columns.reshape(-1, 1, 1, columns.shape[-1])
    seen = mask_function(first, first, rows[None, None, :, None], listed)[:, 0]
    size = (len(rows), columns.shape[-1])  # a rule may go by one of both
    return seen.expand(len(listed), *size).reshape(*columns.shape[:-1], *size)
