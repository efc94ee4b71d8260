"""Whether an eye can tell two pictures apart."""

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.generation.twins.pictures import are_clearly_unlike, channel_differences

SIZE = 300


def picture(path, edge=0, by=0):
    """Write a grey picture with a lighter square at its corner."""
    pixels = np.full((SIZE, SIZE, 3), 100, np.uint8)
    pixels[:edge, :edge] += np.uint8(by)
    Image.fromarray(pixels).save(path)
    return path


def test_differences_are_of_each_channel(tmp_path):
    one, other = picture(tmp_path / "a.png"), picture(tmp_path / "b.png", 2, 30)
    differences = channel_differences(other, one)
    assert differences.shape == (SIZE, SIZE, 3)
    assert differences.sum() == 2 * 2 * 3 * 30


@pytest.mark.parametrize(
    ("edge", "by", "unlike"),
    [
        (14, 50, True),  # 196 pixels: two outlines of a thing that counts as shown
        (13, 50, False),  # 169 pixels: the edge of a door
        (100, 20, False),  # a shadow
        (0, 0, False),
    ],
)
def test_an_eye_needs_enough_pixels_that_differ_enough(edge, by, unlike, tmp_path):
    one, other = picture(tmp_path / "a.png"), picture(tmp_path / "b.png", edge, by)
    assert are_clearly_unlike(one, other) is unlike


@pytest.mark.parametrize(
    ("box", "pixels", "unlike"),
    [
        ((0, 0, 99, 99), 2000, True),  # 400 of its pixels differ
        ((0, 0, 99, 99), 4100, False),  # the edge of a door: less than a tenth
        ((50, 50, 99, 99), 2000, False),  # what differs is another object
        ((19, 0, 99, 99), 200, True),  # 20 of 200
    ],
)
def test_what_is_asked_about_must_differ_itself(box, pixels, unlike, tmp_path):
    one, other = picture(tmp_path / "a.png"), picture(tmp_path / "b.png", 20, 50)
    assert are_clearly_unlike(one, other, [ObjectInFrame(pixels, box)]) is unlike
