"""Images are resized to the last bit as Pillow resizes them."""

import numpy as np
import pytest
from PIL import Image

from model_adapters.hf.loading.resampling import FILTERS, find_resize


def _noise(height, width, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (3, height, width), np.uint8)


def _by_pillow(pixels, size, resample):
    height, width = size
    image = Image.fromarray(np.ascontiguousarray(pixels.transpose(1, 2, 0)))
    resized = image.resize((width, height), Image.Resampling(resample))
    return np.asarray(resized).transpose(2, 0, 1)


@pytest.mark.parametrize("resample", FILTERS)
@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((100, 100), (103, 103)),
        ((90, 120), (200, 50)),
        ((120, 90), (50, 200)),  # Pillow begins with the rows
        ((90, 120), (90, 64)),
        ((90, 120), (33, 120)),
        ((64, 600), (700, 700)),  # more columns than the weights are read of at once
    ],
)
def test_pixels_are_pillows(before, after, resample):
    probe = _noise(*before)
    resize = find_resize(probe, _by_pillow(probe, after, resample), None)
    assert resize is not None
    for pixels in (_noise(*before, seed=1), np.zeros((3, *before), np.uint8)):
        assert np.array_equal(resize(pixels), _by_pillow(pixels, after, resample))


def test_layouts_of_memory_make_no_difference():
    probe = _noise(80, 90)
    resize = find_resize(probe, _by_pillow(probe, (100, 70), 3), 3)
    assert resize is not None
    rows_of_colours = np.ascontiguousarray(probe.transpose(1, 2, 0)).transpose(2, 0, 1)
    assert np.array_equal(resize(rows_of_colours), resize(probe))


def test_an_image_that_stays_as_it_is_is_copied():
    probe = _noise(40, 50)
    resize = find_resize(probe, probe, 3)
    assert resize is not None
    assert np.array_equal(resize(probe), probe)
    assert not np.shares_memory(resize(probe), probe)


def test_what_pillow_does_not_do_is_not_found():
    probe = _noise(40, 50)
    resized = _by_pillow(probe, (60, 60), 3).copy()
    resized[0, 0, 0] ^= 1
    assert find_resize(probe, resized, None) is None
