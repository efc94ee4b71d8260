"""Preprocessing of frames for policies."""

import numpy as np
import torch
from PIL import Image

__all__ = ["normalise", "resize"]


def resize(image: Image.Image, size: int) -> torch.Tensor:
    """Return an RGB frame, squashed to a square of pixels by PIL's bicubic filter, (3, size, size),
    from 0 to 1."""
    pixels = np.asarray(image.resize((size, size), Image.Resampling.BICUBIC), dtype=np.float32)
    return torch.from_numpy(pixels / 255).permute(2, 0, 1).contiguous()


def normalise(
    pixels: torch.Tensor, mean: tuple[float, float, float], std: tuple[float, float, float]
) -> torch.Tensor:
    """Return pixels, (..., 3, height, width), minus each channel's mean, by its deviation."""
    shape = (3, 1, 1)
    return (pixels - pixels.new_tensor(mean).view(shape)) / pixels.new_tensor(std).view(shape)
