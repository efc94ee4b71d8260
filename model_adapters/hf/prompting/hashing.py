"""Short hashes of what a model reads, by which runs are compared: tokens, and pixels.

A hash of all bytes of a frame's pixels takes longer than making them. They are added up first, row
by row, in rows of 4 KiB: a value that differs changes a sum.
"""

from array import array
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import torch

from infthor_eval.storage.digests import digest
from model_adapters.hf.family import Pixels

_SIZE = 4  # bytes of a hash: a record has two
_ROW = 1024  # values of a row


def hash_context(ids: Iterable[int]) -> str:
    """Return the hash of the ids of a context's tokens, frames expanded (hex, 8 characters)."""
    return digest(array("q", ids).tobytes(), _SIZE)


def hash_frame(pixels: Pixels) -> str:
    """Return the hash of the values that an image processor makes of a frame (hex, 8 characters);
    what is no fraction (sizes, masks) is not among them."""
    fractions = (pixels[name] for name in sorted(pixels) if _is_fraction(pixels[name]))
    return digest(b"".join(map(_sums, fractions)), _SIZE)


def hash_frames(hashes: Iterable[str]) -> str:
    """Return the hash of several frames in order, by their own hashes (hex, 8 characters)."""
    return digest("".join(hashes), _SIZE)


def split_frames(inputs: Mapping[str, Any], n: int) -> Iterator[Pixels]:
    """Yield what a processor made of each of `n` frames, as if it were alone; nothing if it cannot
    be told which is whose."""
    values = inputs.get("pixel_values")
    grids = inputs.get("image_grid_thw")
    if not isinstance(values, torch.Tensor):
        return
    if isinstance(grids, torch.Tensor):
        if len(grids) == n:
            sizes = grids.prod(-1).tolist()
            yield from ({"pixel_values": part} for part in values.split(sizes))
    elif len(values) == n:
        yield from ({"pixel_values": part} for part in values)


def _is_fraction(value: Any) -> bool:
    return isinstance(value, torch.Tensor) and value.is_floating_point()


def _sums(values: torch.Tensor) -> bytes:
    bits = values.float().contiguous().reshape(-1).numpy().view(np.uint32)
    n_rows = len(bits) // _ROW
    rows = bits[: n_rows * _ROW].reshape(n_rows, _ROW)
    sums: bytes = np.add.reduce(rows, axis=0, dtype=np.uint32).tobytes()
    return sums + bits[n_rows * _ROW :].tobytes()
