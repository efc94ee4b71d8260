"""Attention of one's own in a decoder of transformers, by its interface, for a while."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from torch import Tensor
from transformers.masking_utils import AttentionMaskInterface
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import ModelError

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


class CannotAttendError(ModelError):
    """A model attends in a way that cannot be taken the place of."""


@contextmanager
def attending(
    config: Any, name: str, attention: Callable[..., Any], mask: Callable[..., Tensor]
) -> Iterator[None]:
    """Let a decoder attend by these functions within the context.

    Args:
        config: config of the decoder.
        name: a name that nobody else uses at the same time.
        attention: in the form of transformers' attention functions.
        mask: in the form of transformers' mask functions.
    """
    before = config._attn_implementation
    # The functions are put into the dictionaries directly, because registered ones cannot be
    # removed; transformers looks for masks in that of the class.
    masks = AttentionMaskInterface._global_mapping
    ALL_ATTENTION_FUNCTIONS[name] = attention
    masks[name] = mask
    config._attn_implementation = name
    try:
        yield
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[name], masks[name]


def require_plain(attention_mask: Tensor | None, others: dict[str, Any], hint: str) -> Tensor:
    """Return a layer's mask, if it adds nothing else to the scores.

    Raises:
        CannotAttendError: it adds something, or has no mask.
    """
    added = [name for name in _NOT_COMPUTED if others.get(name) is not None]
    if added:
        raise CannotAttendError(f"the model's attention has {added[0]}; {hint}")
    if attention_mask is None:
        raise CannotAttendError(
            f"the model's masks are not all made by transformers' functions; {hint}"
        )
    return attention_mask


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
