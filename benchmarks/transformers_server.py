"""`transformers serve` where there is but half of torchvision, whose other half is built for CUDA.

    python benchmarks/transformers_server.py serve --device cpu

A Qwen2.5-VL is served with torchvision alone. Its Python half is looked for where `make test` puts
it, if it is not in the environment. What that half lacks are the names of operators, which nothing
here calls, and the decoder of pictures, for which Pillow's stands: a PNG has the same pixels in
both.
"""

import importlib.util
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

_PEERS = Path(sys.prefix) / "test-peers"
_OPERATOR = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"


def main() -> None:
    """Complete torchvision, and run the command of transformers with this one's words."""
    if importlib.util.find_spec("torchvision") is None:
        sys.path.append(str(_PEERS))
    for name in ("nms", "qnms"):
        torch.library.define(f"torchvision::{name}", _OPERATOR)
    import torchvision.io

    torchvision.io.decode_image = torchvision.io.image.decode_image = _decode
    from transformers.cli.transformers import main as run

    run()


def _decode(encoded: torch.Tensor, **_: Any) -> torch.Tensor:
    """Return the pixels of a picture's bytes, (3, height, width)."""
    image = Image.open(io.BytesIO(encoded.numpy().tobytes())).convert("RGB")
    return torch.from_numpy(np.array(image)).permute(2, 0, 1)


if __name__ == "__main__":
    main()
