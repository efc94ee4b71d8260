"""Attention of the package flash-attn on shapes, whether it is installed or not.

It takes no mask and knows by itself who attends to whom, by windows of layers too; heads that share
keys are not repeated. So it needs less memory than torch's attention with a mask.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from model_adapters.hf.rehearsal.device import ShapesDevice
from model_adapters.hf.rehearsal.kernels import Attention

FLASH_ATTENTION = "flash_attention_2"
_LARGEST_HEAD = 256
_SUM_BYTES = 4  # of a row's sum, which is kept in float32


def flash_problem(model: Any, largest_head: int, sees_ahead: bool) -> str:
    """Return why a model cannot run with flash-attn; empty if it can.

    Args:
        model: the transformers model.
        largest_head: numbers of its largest head.
        sees_ahead: whether tokens of a frame attend to later ones of it.
    """
    if not getattr(model, "_supports_flash_attn", False):
        return "the model's code does not support it"
    if largest_head > _LARGEST_HEAD:
        return f"heads of {largest_head} are larger than {_LARGEST_HEAD}"
    return "it cannot attend in both directions over a frame" if sees_ahead else ""


@contextmanager
def flash_attention(config: Any, device: ShapesDevice) -> Iterator[None]:
    """Let a decoder with this config attend by flash-attn within the context."""

    def attend(
        module: Any,  # noqa: ARG001 - the form of transformers' attention functions
        query: torch.Tensor,
        key: torch.Tensor,
        value: torch.Tensor,
        *_: Any,
        **__: Any,
    ) -> tuple[torch.Tensor, None]:
        batch, heads, n_queries, head = query.shape
        call = Attention(
            kernel=FLASH_ATTENTION,
            has_mask=False,
            n_queries=n_queries,
            n_keys=key.shape[-2],
            head_size=head,
            flop=2 * batch * heads * n_queries * key.shape[-2] * (head + value.shape[-1]),
            own_bytes=batch * heads * n_queries * _SUM_BYTES,
        )
        device.attention.append(call)
        device.use(call.own_bytes)
        return query.new_empty((batch, n_queries, heads, value.shape[-1])), None

    before = config._attn_implementation
    ALL_ATTENTION_FUNCTIONS[FLASH_ATTENTION] = attend
    config._attn_implementation = FLASH_ATTENTION
    try:
        yield
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[FLASH_ATTENTION]
