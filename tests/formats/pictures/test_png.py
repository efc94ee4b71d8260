"""Frames as PNG: what is written is what other programs read."""

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.pictures.png import PngWriter, write_png


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


def test_the_writer_has_written_all_when_it_is_left(tmp_path):
    frames = np.random.default_rng(1).integers(0, 256, (30, 5, 4, 3), dtype=np.uint8)
    with PngWriter(tmp_path) as writer:
        for number, frame in enumerate(frames):
            writer.write(f"{number}.png", frame)
    for number, frame in enumerate(frames):
        with Image.open(tmp_path / f"{number}.png") as image:
            assert np.array_equal(np.asarray(image), frame)


@pytest.mark.parametrize("count", [1, 30])
def test_what_cannot_be_written_is_raised(tmp_path, count):
    frame = np.zeros((5, 4, 3), dtype=np.uint8)
    with pytest.raises(FileNotFoundError), PngWriter(tmp_path / "nowhere") as writer:
        for number in range(count):
            writer.write(f"{number}.png", frame)


def test_an_error_in_the_context_is_not_hidden(tmp_path):
    with pytest.raises(KeyError), PngWriter(tmp_path / "nowhere") as writer:
        writer.write("0.png", np.zeros((5, 4, 3), dtype=np.uint8))
        raise KeyError
