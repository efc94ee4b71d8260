"""The vision tower on many frames of one size at once, for training.

transformers computes the attention of each frame by itself, and embeds both time steps of a patch,
which are the same picture. One call for all frames takes two thirds of the time.
"""

from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import linear, scaled_dot_product_attention
from transformers.models.qwen2_5_vl.modeling_qwen2_5_vl import (
    apply_rotary_pos_emb_vision,
    get_vision_position_ids,
)

__all__ = ["tower_features"]


def tower_features(tower: Any, patches: Tensor) -> Tensor:
    """Return the features of frames, (frames, tokens, hidden), as the tower gives them.

    Args:
        tower: a Qwen2.5-VL vision tower whose windows are whole frames.
        patches: pixels of the patches of square frames, in one of the two time steps, (frames,
            patches, values).
    """
    n_frames, n_patches, _ = patches.shape
    kernel = tower.patch_embed.proj.weight  # (hidden, colours, time, height, width)
    hidden = linear(patches, kernel.sum(2).flatten(1))
    side = int(n_patches**0.5)
    ids = get_vision_position_ids(torch.tensor([[1, side, side]]), tower.spatial_merge_size)
    rotation = tower.rotary_pos_emb(hidden[0], ids)
    for block in tower.blocks:
        hidden = hidden + _attention(block.attn, block.norm1(hidden), rotation)
        hidden = hidden + block.mlp(block.norm2(hidden))
    merged: Tensor = tower.merger(hidden.flatten(0, 1))
    return merged.reshape(n_frames, -1, merged.shape[-1])


def _attention(attention: Any, hidden: Tensor, rotation: tuple[Tensor, Tensor]) -> Tensor:
    n_frames, n_patches, width = hidden.shape
    states = attention.qkv(hidden).reshape(n_frames, n_patches, 3, attention.num_heads, -1)
    query, key, value = states.unbind(2)
    query, key = apply_rotary_pos_emb_vision(query, key, *rotation)
    query, key, value = (one.transpose(1, 2) for one in (query, key, value))
    mixed = scaled_dot_product_attention(query, key, value).transpose(1, 2)
    output: Tensor = attention.proj(mixed.reshape(n_frames, n_patches, width))
    return output
