"""The first layer of the tower, set to the principal components of the training data's patches.

From random filters, which are noise, the tower needs four times as many frames to see as much (the
trials are in the model card).
"""

from typing import Any

import torch
from torch import Tensor

_SMOOTHING = 1e-3  # of the mean variance, added to each; components of less are noise
_SCALE = 0.5  # standard deviation of the filters' outputs


def whiten_patches(tower: Any, pixels: Tensor, seed: int) -> None:
    """Set the patch embedding to filters whose outputs on the frames are about uncorrelated.

    The filters are the first principal components, scaled to equal variance and rotated at random.

    Args:
        tower: a Qwen2.5-VL vision tower.
        pixels: patches of frames, (frames, patches, values).
        seed: seed of the rotation.
    """
    generator = torch.Generator().manual_seed(seed)
    patches = pixels.flatten(0, 1)
    variances, components = torch.linalg.eigh(patches.T @ patches / len(patches))
    kernel = tower.patch_embed.proj.weight  # (hidden, colours, time, height, width)
    width, colours, n_times, *side = kernel.shape
    n_kept = min(width, len(variances))
    scales = (variances[-n_kept:] + _SMOOTHING * variances.mean()).rsqrt()
    whitened = scales[:, None] * components[:, -n_kept:].T
    rotation = torch.empty(width, n_kept)
    torch.nn.init.orthogonal_(rotation, generator=generator)
    filters = (_SCALE * rotation @ whitened).reshape(width, colours, 1, *side)
    with torch.no_grad():
        # Both time steps are the same picture, and their sum counts.
        kernel.copy_(filters.expand(-1, -1, n_times, -1, -1) / n_times)
