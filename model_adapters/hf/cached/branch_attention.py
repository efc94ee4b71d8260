"""Attention of several continuations of one prefix that stand behind it in one sequence.

Every token attends to the prefix and to the earlier tokens of its own continuation. So keys and
values of the prefix are stored once and read once for all continuations, as in Hydragen
(arXiv:2402.05099).
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import ModelError

__all__ = ["BranchAttention", "can_branch"]

_NOT_COMPUTED = ("softcap", "s_aux", "position_bias")  # what some models add to the scores


def can_branch(model: Any) -> bool:
    """Return whether a model's attention can be replaced by `BranchAttention`."""
    decoder = model.get_decoder()
    # Eager attention is chosen for what its model adds to the scores.
    return bool(getattr(decoder, "_supports_attention_backend", False)) and (
        decoder.config._attn_implementation != "eager"
    )


class BranchAttention:
    """Attention in a sequence of a prefix and branches, its continuations, in pieces of any order.

    Args:
        config: config of the decoder.
        n_prefix: tokens of the prefix.
        device: device of the decoder's inputs.
    """

    def __init__(self, config: Any, n_prefix: int, device: torch.device) -> None:
        self._config = config
        self._n_prefix = n_prefix
        # Branch of each token behind the prefix.
        self._branches = torch.empty(0, dtype=torch.long, device=device)
        # Position of each in prefix and branch.
        self._positions = torch.empty(0, dtype=torch.long, device=device)
        self._n_new = 0
        self._masks: dict[tuple[int | None, torch.device], Tensor] = {}
        self._n_calls = 0

    @contextmanager
    def appended(self, branches: Sequence[int], n_before: Sequence[int]) -> Iterator[None]:
        """Attend this way within the context, in which the decoder is given more tokens once.

        Args:
            branches: the branch of each token.
            n_before: number of tokens before each in its branch and the prefix.

        Raises:
            ModelError: the decoder has layers that do not attend by transformers' interface.
        """
        new = torch.tensor([branches, n_before]).to(self._branches.device)
        self._branches = torch.cat((self._branches, new[0]))
        self._positions = torch.cat((self._positions, new[1]))
        self._n_new = len(branches)
        self._masks.clear()
        self._n_calls = 0
        name = f"branches_{id(self)}"
        before = self._config._attn_implementation
        # transformers creates no mask for a name that it does not know. The function is put into
        # the dictionary directly, because a registered one cannot be removed.
        ALL_ATTENTION_FUNCTIONS[name] = self._attention
        self._config._attn_implementation = name
        try:
            yield
        finally:
            self._config._attn_implementation = before
            del ALL_ATTENTION_FUNCTIONS[name]
        if self._n_calls != self._config.num_hidden_layers:
            raise ModelError(
                "the model's layers do not all attend by transformers' interface; set batch_size=1"
            )

    def _attention(
        self,
        module: Any,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        attention_mask: None,
        *,
        scaling: float | None = None,
        sliding_window: int | None = None,
        **others: Any,
    ) -> tuple[Tensor, None]:
        """Return the attention of the new tokens, in the form of transformers' attention functions.

        Args:
            module: attention module of the layer.
            query: queries, (1, heads, new tokens, head size).
            key: keys, (1, key heads, all tokens, head size).
            value: values, like `key`.
            attention_mask: None.
            scaling: factor of the dot products; by the head size where None.
            sliding_window: a token attends to fewer tokens than this before it; to all where None.
            others: settings of some models.

        Returns:
            The outputs, (1, new tokens, heads, head size), and None instead of weights.

        Raises:
            ModelError: the model adds something to the scores.
        """
        added = [name for name in _NOT_COMPUTED if others.get(name) is not None]
        if added:
            raise ModelError(f"the model's attention has {added[0]}; set batch_size=1")
        self._n_calls += 1
        n_key_heads = key.shape[1]
        # Heads that share keys become the second axis, along which a view repeats keys without a
        # copy.
        shared = (n_key_heads, query.shape[1] // n_key_heads)
        output = scaled_dot_product_attention(
            query.unflatten(1, shared)[0],
            key[0, :, None].expand(-1, shared[1], -1, -1),
            value[0, :, None].expand(-1, shared[1], -1, -1),
            attn_mask=self._mask(sliding_window, query),
            scale=scaling,
        )
        return output.flatten(0, 1).transpose(0, 1)[None], None

    def _mask(self, window: int | None, query: Tensor) -> Tensor:
        """Return what is added to scores, (new tokens, all tokens): 0 or minus infinity."""
        key = (window, query.device)  # a model can be on several devices
        if key not in self._masks:
            self._masks[key] = self._new_mask(window, query.dtype).to(query.device)
        return self._masks[key]

    def _new_mask(self, window: int | None, dtype: torch.dtype) -> Tensor:
        new = slice(len(self._branches) - self._n_new, None)
        own = self._branches[new, None]
        at = self._positions[new, None]
        seen = (self._branches == own) & (self._positions <= at)
        mask = torch.zeros(
            self._n_new, self._n_prefix + len(self._branches), dtype=dtype, device=seen.device
        )
        mask[:, self._n_prefix :].masked_fill_(~seen, -torch.inf)
        if window is not None:
            prefix = torch.arange(self._n_prefix, device=seen.device)
            mask.masked_fill_(torch.cat((prefix, self._positions)) <= at - window, -torch.inf)
        return mask
