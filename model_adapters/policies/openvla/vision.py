"""Vision transformers with timm's names of parameters, as in OpenVLA's checkpoints."""

from typing import Literal

import msgspec
import torch
from torch import nn
from torch.nn.functional import gelu, scaled_dot_product_attention

from model_adapters.policies.weights import Shape, empty_parameters

_EPS = 1e-6
_REGISTERS = 4


class TowerShape(msgspec.Struct, frozen=True):
    """Sizes of a tower.

    Attributes:
        kind: dinov2 has a class token, four registers and layer scales; siglip has a pooling head
            instead.
        width: width of a patch's features.
        depth: blocks in the checkpoint; the last one is not run.
        heads: attention heads.
        mlp_width: width of the hidden layer of a block's MLP.
        patch: side of a patch in pixels.
    """

    kind: Literal["dinov2", "siglip"]
    width: int
    depth: int
    heads: int
    mlp_width: int
    patch: int = 14


# By timm's names, which a checkpoint's config has.
TOWERS = {
    "vit_large_patch14_reg4_dinov2.lvd142m": TowerShape("dinov2", 1024, 24, 16, 4096),
    "vit_so400m_patch14_siglip_224": TowerShape("siglip", 1152, 27, 16, 4304),
}


class _Attention(nn.Module):
    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.heads = shape.heads
        self.qkv = nn.Linear(shape.width, 3 * shape.width)
        self.proj = nn.Linear(shape.width, shape.width)

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        batch, length, width = tokens.shape
        query, key, value = (
            self.qkv(tokens).view(batch, length, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        )
        mixed = scaled_dot_product_attention(query, key, value)
        return self.proj(mixed.transpose(1, 2).reshape(batch, length, width))


class _Mlp(nn.Module):
    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.fc1 = nn.Linear(shape.width, shape.mlp_width)
        self.fc2 = nn.Linear(shape.mlp_width, shape.width)

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        # timm uses the exact GELU, also for SigLIP, which was trained with the tanh approximation.
        return self.fc2(gelu(self.fc1(tokens)))


class _LayerScale(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.scale_factor = nn.Parameter(torch.empty(width))  # OpenVLA's name of timm's `gamma`

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        return tokens * self.scale_factor


class _Block(nn.Module):
    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        scaled = shape.kind == "dinov2"
        self.norm1 = nn.LayerNorm(shape.width, eps=_EPS)
        self.attn = _Attention(shape)
        self.ls1 = _LayerScale(shape.width) if scaled else nn.Identity()
        self.norm2 = nn.LayerNorm(shape.width, eps=_EPS)
        self.mlp = _Mlp(shape)
        self.ls2 = _LayerScale(shape.width) if scaled else nn.Identity()

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        tokens = tokens + self.ls1(self.attn(self.norm1(tokens)))
        return tokens + self.ls2(self.mlp(self.norm2(tokens)))


class _PatchEmbedding(nn.Module):
    def __init__(self, shape: TowerShape) -> None:
        super().__init__()
        self.proj = nn.Conv2d(3, shape.width, kernel_size=shape.patch, stride=shape.patch)

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        return self.proj(pixels).flatten(2).transpose(1, 2)


class Tower(nn.Module):
    """A tower up to its second-to-last block, whose features OpenVLA uses without a final norm."""

    def __init__(self, shape: TowerShape, image_size: int) -> None:
        super().__init__()
        n_patches = (image_size // shape.patch) ** 2
        if shape.kind == "dinov2":
            self.cls_token = nn.Parameter(torch.empty(1, 1, shape.width))
            self.reg_token = nn.Parameter(torch.empty(1, _REGISTERS, shape.width))
        self.pos_embed = nn.Parameter(torch.empty(1, n_patches, shape.width))
        self.patch_embed = _PatchEmbedding(shape)
        self.blocks = nn.ModuleList(_Block(shape) for _ in range(shape.depth - 1))
        self._has_prefix = shape.kind == "dinov2"

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        """Return features of the patches, (batch, patches, width), of normalised pixels, (batch, 3,
        size, size)."""
        tokens = self.patch_embed(pixels) + self.pos_embed
        n_patches = tokens.shape[1]
        if self._has_prefix:
            prefix = torch.cat([self.cls_token, self.reg_token], dim=1).expand(len(tokens), -1, -1)
            tokens = torch.cat([prefix, tokens], dim=1)
        for block in self.blocks:
            tokens = block(tokens)
        return tokens[:, -n_patches:]


def unused_keys(shape: TowerShape) -> dict[str, Shape]:
    """Return a tower's keys that no feature depends on: last block, final norm, pooling head."""
    width = shape.width
    with empty_parameters():
        last = _Block(shape).state_dict()
    keys: dict[str, Shape] = {
        f"blocks.{shape.depth - 1}.{name}": tuple(value.shape) for name, value in last.items()
    }
    keys |= _affine("norm", width)
    if shape.kind == "siglip":
        keys["attn_pool.latent"] = (1, 1, width)
        keys |= _linear("attn_pool.q", width, width) | _linear("attn_pool.kv", width, 2 * width)
        keys |= _linear("attn_pool.proj", width, width) | _affine("attn_pool.norm", width)
        keys |= _linear("attn_pool.mlp.fc1", width, shape.mlp_width) | _linear(
            "attn_pool.mlp.fc2", shape.mlp_width, width
        )
    return keys


def _affine(name: str, width: int) -> dict[str, Shape]:
    return {f"{name}.weight": (width,), f"{name}.bias": (width,)}


def _linear(name: str, inputs: int, outputs: int) -> dict[str, Shape]:
    return {f"{name}.weight": (outputs, inputs), f"{name}.bias": (outputs,)}
