"""Files that move."""

import cv2
import numpy as np
import pytest
from PIL import Image

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.pictures.animations import require_animation_name, write_animation

SHADES = (0, 60, 60, 120, 180, 240)


def shades():
    return (Image.new("RGB", (64, 48), (shade, shade, shade)) for shade in SHADES)


def pictures_of(path):
    """The pictures of a GIF and how long each is shown, in milliseconds."""
    with Image.open(path) as gif:
        for number in range(gif.n_frames):
            gif.seek(number)
            yield np.asarray(gif.convert("RGB")), gif.info["duration"]


def test_an_mp4_has_every_picture_in_its_size_and_time(tmp_path):
    path = tmp_path / "a.mp4"
    assert write_animation(path, shades(), 3.0) == len(SHADES)
    video = cv2.VideoCapture(str(path))
    assert video.get(cv2.CAP_PROP_FPS) == 3.0
    for shade in SHADES:
        decoded, pixels = video.read()
        assert decoded
        assert pixels.shape == (48, 64, 3)
        assert abs(float(pixels.mean()) - shade) < 6
    assert not video.read()[0]


def test_a_gif_shows_every_picture_for_its_time(tmp_path):
    path = tmp_path / "a.GIF"
    assert write_animation(path, shades(), 4.0) == len(SHADES)
    seen, durations = zip(*pictures_of(path), strict=True)
    assert seen[0].shape == (48, 64, 3)
    assert sum(durations) == pytest.approx(len(SHADES) * 250, abs=10 * len(SHADES))
    assert [frame[5, 5, 0] for frame in seen] == sorted(
        set(SHADES)
    )  # two alike are one, shown for twice as long


def test_what_does_not_move_keeps_its_colours_in_a_gif(tmp_path):
    path = tmp_path / "a.gif"
    ramp = np.linspace(0, 255, 64).astype(np.uint8)
    still = np.zeros((48, 64, 3), np.uint8)
    still[..., 0], still[..., 1], still[..., 2] = ramp, 90, ramp[::-1]
    noise = np.random.default_rng(0).integers(0, 256, (6, 48, 64, 3), dtype=np.uint8)
    pictures = [
        np.concatenate([still, moving // (number + 1)], axis=1)
        for number, moving in enumerate(noise)
    ]
    write_animation(path, map(Image.fromarray, pictures), 4.0)
    seen = [frame[:, :64] for frame, _ in pictures_of(path)]
    assert len(seen) == len(pictures)
    assert all((frame == seen[0]).all() for frame in seen)
    assert abs(seen[0].astype(int) - still).mean() < 12


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_the_same_pictures_are_the_same_bytes(tmp_path, name):
    (tmp_path / "other").mkdir()
    paths = tmp_path / name, tmp_path / "other" / name
    for path in paths:
        write_animation(path, shades(), 2.0)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_nothing_is_left_where_a_picture_fails(tmp_path, name):
    def failing():
        yield from shades()
        raise DataError("no frame")

    with pytest.raises(DataError, match="no frame"):
        write_animation(tmp_path / name, failing(), 2.0)
    assert list(tmp_path.iterdir()) == []


def test_other_names_are_refused(tmp_path):
    for name in ("a.avi", "a", ".mp4"):
        with pytest.raises(UsageError, match=r"ends in \.mp4 or \.gif"):
            require_animation_name(tmp_path / name)
    with pytest.raises(DataError, match="cannot be written"):
        write_animation(tmp_path / "none" / "a.mp4", shades(), 2.0)
