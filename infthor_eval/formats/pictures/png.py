"""Writing rendered frames as PNG, quickly.

Pillow filters each row before it compresses it: that suits photographs. Rendered frames, with their
even areas, come out smaller without a filter, and in a third of the time.
"""

import os
import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from infthor_eval.storage.background import Background

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_LEVEL = 3  # 6 takes twice as long and shrinks rendered frames by a sixth
_RGB = (8, 2, 0, 0, 0)  # bits, colour type, compression, filter method, not interlaced


def write_png(path: Path, frame: NDArray[np.uint8], level: int) -> None:
    """Write an RGB frame [height, width, 3]; higher compression levels take longer.

    Raises:
        OSError: the file cannot be written.
    """
    height, width, _ = frame.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # each row begins with 0: no filter
    rows[:, 1:] = frame.reshape(height, 3 * width)
    parts = (
        _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, *_RGB)),
        _chunk(b"IDAT", zlib.compress(rows.tobytes(), level)),
        _chunk(b"IEND", b""),
    )
    path.write_bytes(_SIGNATURE + b"".join(parts))


class PngWriter(Background):
    """Writes frames into a folder in a thread of its own, while the next ones are drawn."""

    def __init__(self, folder: Path) -> None:
        super().__init__("png")
        self.folder = folder

    def write(self, name: str, frame: NDArray[np.uint8]) -> None:
        """Write an RGB frame [height, width, 3], which must not change any more."""
        self.run(write_png, self.folder / name, frame, _LEVEL)

    def link(self, source: Path, target: Path) -> None:
        """Give a file that this writer or an earlier one wrote a second name."""
        self.run(os.link, source, target)


def _chunk(name: bytes, content: bytes) -> bytes:
    checksum = zlib.crc32(content, zlib.crc32(name))
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", checksum)
