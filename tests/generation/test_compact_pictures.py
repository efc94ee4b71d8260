"""Pictures of one trajectory stored in few bytes."""

import shutil
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.shared_frames import read_shared_frames, write_frame_names
from infthor_eval.generation.compact.pictures import PictureStore

SIDE = 24
COLORS = np.array(
    [[0, 0, 0], [255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 0], [255, 255, 255]], np.uint8
)
# Corner, extent and colour of a rectangle that differs from the picture before.
RECTANGLES = st.tuples(*[st.integers(0, SIDE - 1)] * 4, st.integers(0, len(COLORS) - 1))


def _stored(root: Path, pictures: list[np.ndarray], colors: int) -> tuple[list[FrameRef], Path]:
    """The frames of a set in which pictures are stored, and the folder of the set."""
    own = root / "own"
    own.mkdir(parents=True)
    frames = []
    for number, picture in enumerate(pictures):
        Image.fromarray(picture).save(own / f"{number}.png")
        frames.append(FrameRef(own / f"{number}.png"))
    out = root / "set"
    folder = out / "metadata" / "t"
    folder.mkdir(parents=True)
    store = PictureStore(out, frames, colors)
    write_frame_names(folder, [store.name(frame) for frame in frames])
    return list((read_shared_frames(folder, range(len(frames)), {}) or {}).values()), out


@given(st.lists(RECTANGLES, min_size=1, max_size=12))
def test_patched_pictures_load_to_the_same_pixels(rectangles):
    pictures = [np.full((SIDE, SIDE), 4)]
    for left, top, width, height, color in rectangles:
        changed = pictures[-1].copy()
        changed[top : top + height + 1, left : left + width + 1] = color
        pictures.append(changed)
    pictures[0][: len(COLORS)] = np.arange(len(COLORS))[:, None]  # has all colours
    shown = [COLORS[picture] for picture in pictures]
    root = Path(tempfile.mkdtemp())
    try:
        frames, _ = _stored(root, shown, 32)
        for frame, picture in zip(frames, shown, strict=True):
            assert np.array_equal(np.asarray(frame.load()), picture)
        equal = {picture.tobytes() for picture in shown}
        assert len({frame.digest for frame in frames}) == len(equal)
        assert all(len(frame.patches) <= 3 for frame in frames)
    finally:
        shutil.rmtree(root)


def _noise() -> list[np.ndarray]:
    """A picture of noise, the same again, and one with another object in it."""
    first = 50 * np.random.default_rng(0).integers(0, 5, (100, 100, 3), dtype=np.uint8)
    second = first.copy()
    second[40:50, 60:66] = (255, 0, 0)
    return [first, first, second]


def test_a_picture_that_differs_in_a_part_takes_few_bytes(tmp_path):
    frames, out = _stored(tmp_path, _noise(), 64)
    assert [len(frame.patches) for frame in frames] == [0, 0, 1]
    sizes = sorted(path.stat().st_size for path in (out / "frames").iterdir())
    assert len(sizes) == 2
    assert sizes[0] * 10 < sizes[1]
    below, _, patched = (np.asarray(frame.load()) for frame in frames)
    differing = np.argwhere((below != patched).any(axis=2))
    assert differing.min(axis=0).tolist() == [40, 60]
    assert differing.max(axis=0).tolist() == [49, 65]


def test_the_same_pictures_are_the_same_files(tmp_path):
    first, one = _stored(tmp_path / "one", _noise(), 16)
    second, other = _stored(tmp_path / "other", _noise(), 16)
    assert [frame.digest for frame in first] == [frame.digest for frame in second]
    names = [{path.name for path in (out / "frames").iterdir()} for out in (one, other)]
    assert names[0] == names[1]


def test_a_small_object_keeps_its_colour(tmp_path):
    """A palette by the number of pixels alone would have greys alone."""
    grey = np.linspace(60, 200, 100, dtype=np.uint8)
    picture = np.repeat(np.tile(grey, (100, 1))[..., None], 3, axis=2)
    picture[50:56, 50:56] = (220, 20, 30)
    (frame,), _ = _stored(tmp_path, [picture], 16)
    red, green, blue = frame.load().getpixel((52, 52))
    assert red > 180
    assert max(green, blue) < 80
