"""Preprocessing of frames for policies."""

import math

import numpy as np
import torch
from PIL import Image

_CROPPED = 0.9  # of a frame's area, as in OpenVLA's evaluation on LIBERO


def resize(image: Image.Image, size: int) -> torch.Tensor:
    """Return an RGB frame, squashed to a square of pixels by PIL's bicubic filter, (3, size, size),
    from 0 to 1."""
    pixels = np.asarray(image.resize((size, size), Image.Resampling.BICUBIC), dtype=np.float32)
    return torch.from_numpy(pixels / 255).permute(2, 0, 1).contiguous()


def crop_centre(image: Image.Image, size: int) -> Image.Image:
    """Return the middle of an RGB frame, 90 % of its area, as a square of pixels: by TensorFlow's
    rules, bilinear from corner to corner and 255.5 levels cut to 8 bits, as OpenVLA was trained."""
    side = math.sqrt(_CROPPED)
    pixels = torch.from_numpy(np.array(image, dtype=np.float32) / 255).permute(2, 0, 1)[None]
    places = torch.nn.functional.affine_grid(
        torch.tensor([[[side, 0.0, 0.0], [0.0, side, 0.0]]]), [1, 3, size, size], align_corners=True
    )
    cropped = torch.nn.functional.grid_sample(pixels, places, align_corners=True)[0]
    levels = (cropped * 255.5).clamp(0, 255).to(torch.uint8)
    return Image.fromarray(levels.permute(1, 2, 0).numpy())


def normalise(
    pixels: torch.Tensor, mean: tuple[float, float, float], std: tuple[float, float, float]
) -> torch.Tensor:
    """Return pixels, (..., 3, height, width), minus each channel's mean, by its deviation."""
    shape = (3, 1, 1)
    return (pixels - pixels.new_tensor(mean).view(shape)) / pixels.new_tensor(std).view(shape)
