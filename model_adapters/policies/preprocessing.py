"""Frames as the policies see them."""

import numpy as np
import torch
from PIL import Image

__all__ = ["normalised", "resized"]


def resized(image: Image.Image, size: int) -> torch.Tensor:
    """The frame, squashed to a square by PIL's bicubic filter: (3, size, size), values between 0 and 1.

    Args:
        image: RGB.
        size: width and height in pixels.
    """
    pixels = np.asarray(image.resize((size, size), Image.Resampling.BICUBIC), dtype=np.float32)
    return torch.from_numpy(pixels / 255).permute(2, 0, 1).contiguous()


def normalised(pixels: torch.Tensor, mean: tuple[float, float, float], std: tuple[float, float, float]) -> torch.Tensor:
    """Pixels, (..., 3, height, width), less a mean and over a deviation of each channel."""
    shape = (3, 1, 1)
    return (pixels - pixels.new_tensor(mean).view(shape)) / pixels.new_tensor(std).view(shape)
