"""SpatialVLA's 3D positions of patches: depth, back-projection, frequency encoding, an MLP."""

import torch
from torch import nn
from torch.nn.functional import interpolate, pad

from model_adapters.policies.preprocessing import normalise

_HALF = (0.5, 0.5, 0.5)
# Metres; the point in front of the camera that coordinates are relative to.
_CENTRE = (0.0, 0.0, 2.0)
_REACH = 2.0  # metres; coordinates are divided by it


class Ego3DEmbedding(nn.Module):
    """Features of a patch's points, which are added to the patch's own.

    Args:
        n_points: points of each patch.
        n_freqs: frequencies of each coordinate.
        width: width of the features.
    """

    def __init__(self, n_points: int, n_freqs: int, width: int) -> None:
        super().__init__()
        self._n_freqs = n_freqs
        self.position_embedding_head = nn.Sequential(
            nn.Linear(3 * n_points * (2 * n_freqs + 1), width),
            nn.LayerNorm(width),
            nn.ReLU(),
            nn.Linear(width, width),
        )

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        """Return features, (batch, patches, width), of points in metres, (batch, patches, 3 *
        points), in float32."""
        dtype = next(self.parameters()).dtype
        centre = points.new_tensor(_CENTRE).repeat(points.shape[-1] // 3)
        near = ((points - centre) / _REACH).to(dtype).unsqueeze(-1)
        angles = near * 2.0 ** torch.arange(self._n_freqs, device=points.device, dtype=dtype)
        encoded = torch.cat([near, angles.sin(), angles.cos()], dim=-1)
        return self.position_embedding_head(encoded.flatten(2))


def estimate_depth(zoe: nn.Module, pixels: torch.Tensor, zoe_size: int) -> torch.Tensor:
    """Return the depth in metres, (batch, 1, size, size).

    Args:
        zoe: transformers' ZoeDepth.
        pixels: pixels from 0 to 1, (batch, 3, size, size).
        zoe_size: width and height of the images that ZoeDepth was trained on; 384.
    """
    size = pixels.shape[-1]
    border = int((size / 2) ** 0.5 * 3)  # 31 for 224, as in ZoeDepth's own preprocessing
    framed = pad(pixels, (border,) * 4, mode="reflect")
    # Normalised after resizing and with 0.5 for all channels, unlike ZoeDepth: SpatialVLA was
    # trained so.
    inputs = normalise(
        interpolate(framed, (zoe_size, zoe_size), mode="bicubic", align_corners=True), _HALF, _HALF
    )
    depth = zoe(pixel_values=inputs).predicted_depth.unsqueeze(1)
    whole = interpolate(depth, framed.shape[-2:], mode="bicubic", align_corners=True)
    return whole[..., border:-border, border:-border]


def back_project(
    depth: torch.Tensor, intrinsics: torch.Tensor, patch: int, resolution: int
) -> torch.Tensor:
    """Return points before the camera, (batch, patches, 3 * resolution ** 2), metres, float32.

    Args:
        depth: depth in metres, (batch, 1, size, size), in the type of the weights.
        intrinsics: camera intrinsics, (3, 3), in pixels of that size.
        patch: side of a patch in pixels.
        resolution: points along each side of a patch.
    """
    size = depth.shape[-1]
    cell = patch // resolution
    n_patches = size // patch
    n_cells = size // patch * resolution
    middle = torch.arange(0, size, cell, device=depth.device).float() + patch / resolution / 2
    # The original computes these in the type of its weights, which rounds: in bfloat16, 220.5
    # becomes 220.
    middle = middle.to(depth.dtype).float()
    v, u = torch.meshgrid(middle, middle, indexing="ij")
    rays = torch.linalg.inv(intrinsics.float()) @ torch.stack([u, v, torch.ones_like(u)]).reshape(
        3, -1
    )
    averaged = interpolate(depth, (n_cells, n_cells), mode="area").flatten(2)
    points = (rays * averaged).unflatten(2, (n_patches, resolution, n_patches, resolution))
    return points.permute(0, 2, 4, 3, 5, 1).reshape(len(depth), n_patches**2, -1)
