"""`transformers serve` where there is but half of torchvision, whose other half is built for CUDA.

    PYTHONPATH=tests/peers:.venv/test-peers python benchmarks/transformers_server.py serve

A Qwen2.5-VL is served with torchvision alone. What its Python half lacks is the decoder of
pictures, for which Pillow's stands: a PNG has the same pixels in both.
"""

import io
from typing import Any

import numpy as np
import torch
import torchvision.io
from PIL import Image
from transformers.cli.transformers import main as run


def main() -> None:
    """Replace the decoder, and run the command of transformers with this one's words."""
    torchvision.io.decode_image = torchvision.io.image.decode_image = _decode
    run()


def _decode(encoded: torch.Tensor, **_: Any) -> torch.Tensor:
    """Return the pixels of a picture's bytes, (3, height, width)."""
    image = Image.open(io.BytesIO(encoded.numpy().tobytes())).convert("RGB")
    return torch.from_numpy(np.array(image)).permute(2, 0, 1)


if __name__ == "__main__":
    main()
