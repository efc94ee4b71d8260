"""The vision tower on many pictures of one size at once, for training.

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


def patch_states(tower: Any, patches: Tensor) -> Tensor:
    """Return the states of patches after the tower's last layer, (pictures, patches, width).

    Args:
        tower: a Qwen2.5-VL vision tower whose windows are whole pictures.
        patches: pixels of the patches of square pictures, in one of the two time steps, (pictures,
            patches, values).
    """
    kernel = tower.patch_embed.proj.weight  # (width, colours, time, height, width)
    states = linear(patches, kernel.sum(2).flatten(1))
    side = int(patches.shape[1] ** 0.5)
    ids = get_vision_position_ids(torch.tensor([[1, side, side]]), tower.spatial_merge_size)
    rotation = tower.rotary_pos_emb(states[0], ids)
    for block in tower.blocks:
        states = states + _attention(block.attn, block.norm1(states), rotation)
        states = states + block.mlp(block.norm2(states))
    return states


def unit_logits(tower: Any, states: Tensor, n_units: int) -> Tensor:
    """Return the first units of the merger before their nonlinearity, (pictures, tokens, units).

    Args:
        tower: the tower.
        states: states of the patches, (pictures, patches, width).
        n_units: number of units.
    """
    merger = tower.merger
    merged = merger.ln_q(states).reshape(len(states), -1, merger.hidden_size)
    layer = merger.mlp[0]
    return linear(merged, layer.weight[:n_units], layer.bias[:n_units])


def _attention(attention: Any, states: Tensor, rotation: tuple[Tensor, Tensor]) -> Tensor:
    n_pictures, n_patches, width = states.shape
    parts = attention.qkv(states).reshape(n_pictures, n_patches, 3, attention.num_heads, -1)
    query, key, value = parts.unbind(2)
    query, key = apply_rotary_pos_emb_vision(query, key, *rotation)
    query, key, value = (one.transpose(1, 2) for one in (query, key, value))
    mixed = scaled_dot_product_attention(query, key, value).transpose(1, 2)
    output: Tensor = attention.proj(mixed.reshape(n_pictures, n_patches, width))
    return output
