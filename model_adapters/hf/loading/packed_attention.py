"""Attention inside each image or window of a packed batch, all of one length in one call.

transformers' vision towers call torch's kernel for one image or window after the other, unless
attention is flash-attn's, which takes all at once. For a frame of 300x300 the tower of Qwen2.5-VL
7B makes 256 calls, and on an H100 they were most of a frame's time (benchmarks/gpu_h100.md).
"""

import copy
import inspect
from typing import Any

import torch
from torch.utils.weak import WeakTensorKeyDictionary
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

# A tower hands everything over at once to a kernel that has "flash" in its name.
_NAME = "sdpa_in_place_of_flash"
# Places by bounds, for as long as these are there: all layers of a tower are given the same tensor,
# and reading it would make the device wait in each.
_places: WeakTensorKeyDictionary = WeakTensorKeyDictionary()


def pack_attention(model: Any) -> None:
    """Let a model's vision towers attend in all images or windows of one length at once.

    It concerns attention by torch's kernel (`sdpa`) whose module is told where images or windows
    end (`cu_seqlens`). Results are those of one after the other.
    """
    for module in _innermost(model):
        config: Any = getattr(module, "config", None)
        if getattr(config, "_attn_implementation", None) == "sdpa":
            # A config of its own: other modules choose their masks by the tower's.
            own = copy.copy(config)
            own._attn_implementation_internal = _NAME
            module.config = own


def _innermost(module: torch.nn.Module) -> list[torch.nn.Module]:
    """Return the modules that use where images end, without those that only pass it on."""
    within = [found for child in module.children() for found in _innermost(child)]
    if within or "cu_seqlens" not in inspect.signature(module.forward).parameters:
        return within
    return [module]


def _attend(
    module: torch.nn.Module,
    query: torch.Tensor,
    key: torch.Tensor,
    value: torch.Tensor,
    attention_mask: torch.Tensor | None,
    *,
    cu_seq_lens_q: torch.Tensor | None = None,
    **options: Any,
) -> tuple[torch.Tensor, None]:
    """Attend inside each span of a batch of one.

    Args:
        query, key, value: (1, heads, tokens, size of a head).
        cu_seq_lens_q: where spans begin, and the last one ends; None: all is one span.

    Returns:
        (1, tokens, heads, size of a head), and no weights.
    """
    sdpa = ALL_ATTENTION_FUNCTIONS["sdpa"]
    if cu_seq_lens_q is None:
        return sdpa(module, query, key, value, attention_mask, **options)
    tokens = [tensor[0].transpose(0, 1) for tensor in (query, key, value)]
    output = torch.empty_like(tokens[2])
    for places in _by_length(cu_seq_lens_q):
        parts = (tensor[places].transpose(1, 2) for tensor in tokens)
        output[places], _ = sdpa(module, *parts, None, **options)
    return output[None], None


def _by_length(bounds: torch.Tensor) -> list[torch.Tensor]:
    """Return the places of tokens, (spans, length), of all spans of each length."""
    if bounds not in _places:
        lengths = bounds.diff()
        _places[bounds] = [
            bounds[:-1][lengths == length, None] + torch.arange(length, device=bounds.device)
            for length in lengths.unique().tolist()
        ]
    return _places[bounds]


ALL_ATTENTION_FUNCTIONS.register(_NAME, _attend)
