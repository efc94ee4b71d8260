"""Frames as PNG: what is written is what other programs read."""

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.pictures.png import write_png


@pytest.mark.parametrize("shape", [(300, 300, 3), (1, 7, 3), (5, 1, 3)])
@pytest.mark.parametrize("level", [1, 3])
def test_a_frame_is_read_back_bit_by_bit(tmp_path, shape, level):
    frame = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    write_png(tmp_path / "frame.png", frame, level)
    with Image.open(tmp_path / "frame.png") as image:
        image.verify()  # checksums
    with Image.open(tmp_path / "frame.png") as image:
        assert image.mode == "RGB"
        assert np.array_equal(np.asarray(image), frame)


def test_a_flipped_frame_is_written_as_it_is_seen(tmp_path):
    frame = np.arange(5 * 4 * 3, dtype=np.uint8).reshape(5, 4, 3)[::-1]
    write_png(tmp_path / "frame.png", frame, 1)
    with Image.open(tmp_path / "frame.png") as image:
        assert np.array_equal(np.asarray(image), frame)
