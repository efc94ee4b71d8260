"""Frames that are a picture with patches laid over it."""

import re
from pathlib import Path

import pytest
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef, Patch
from infthor_eval.formats.shared_frames import (
    patched_name,
    read_shared_frames,
    store_encoded,
    write_frame_names,
)

RED = (255, 0, 0)
BLUE = (0, 0, 255, 255)


@pytest.fixture
def patched(tmp_path):
    """A red frame of 20x10 pixels with a patch of 4x2 pixels, whose first column is transparent."""
    Image.new("RGB", (20, 10), RED).save(tmp_path / "below.png")
    patch = Image.new("RGBA", (4, 2), BLUE)
    patch.paste((0, 0, 0, 0), (0, 0, 1, 2))
    patch.save(tmp_path / "patch.png")
    return FrameRef(tmp_path / "below.png", (Patch(tmp_path / "patch.png", left=16, top=8),))


def test_a_patch_covers_where_it_is_not_transparent(patched):
    frame = patched.load()
    blue = [(x, y) for y in range(10) for x in range(20) if frame.getpixel((x, y)) == BLUE[:3]]
    assert blue == [(x, y) for y in (8, 9) for x in (17, 18, 19)]
    assert frame.getpixel((16, 8)) == RED
    assert patched.size == frame.size == (20, 10)
    assert patched.problem is None


def test_its_png_has_the_same_pixels(patched, tmp_path):
    (tmp_path / "whole.png").write_bytes(patched.png())
    assert FrameRef(tmp_path / "whole.png").load().tobytes() == patched.load().tobytes()


def test_name_and_digest_differ_with_the_patch_and_its_place(patched):
    (patch,) = patched.patches
    others = [
        patched,
        FrameRef(patched.path),
        FrameRef(patched.path, (Patch(patch.path, 15, 8),)),
        FrameRef(patched.path, (patch, patch)),
        FrameRef(patch.path),
    ]
    assert len({frame.name for frame in others}) == len({frame.digest for frame in others}) == 5
    again = FrameRef(patched.path, (Patch(patch.path, 16, 8),))
    assert (again.name, again.digest) == (patched.name, patched.digest)
    assert patched.n_bytes == sum(path.stat().st_size for path in (patched.path, patch.path))


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-30])


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda frame: cut(frame.patches[0].path), "patch.png: not a readable image"),
        (lambda frame: frame.patches[0].path.write_text("x"), "patch.png: not a readable image"),
        (lambda frame: frame.patches[0].path.unlink(), "patch.png: cannot be read"),
        (lambda frame: frame.path.unlink(), "below.png: cannot be read"),
    ],
)
def test_a_file_that_is_damaged_or_missing_is_named_in_one_line(patched, spoil, words):
    spoil(patched)
    with pytest.raises(DataError, match=words) as error:
        patched.load()
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("place", [(17, 8), (16, 9), (99999, 0)])
def test_a_patch_that_reaches_beyond_the_picture_is_refused(patched, place):
    frame = FrameRef(patched.path, (Patch(patched.patches[0].path, *place),))
    with pytest.raises(DataError, match=r"patch\.png: reaches to .* beyond the 20x10 pixels"):
        frame.load()


def test_a_missing_file_is_a_problem_and_has_no_size(patched):
    patched.patches[0].path.unlink()
    assert "patch.png: cannot be read" in str(patched.problem)
    assert patched.n_bytes is None
    with pytest.raises(DataError, match=r"patch\.png"):
        _ = patched.digest


def _stored(root: Path, frame: FrameRef) -> str:
    """The name of a frame, whose files are stored in a set."""
    name = store_encoded(root, frame.path.read_bytes())
    for patch in frame.patches:
        content = store_encoded(root, patch.path.read_bytes())
        name = patched_name(name, content, patch.left, patch.top)
    return name


@pytest.mark.parametrize("packed", [False, True])
def test_names_of_patched_frames_are_read_as_they_were_written(patched, tmp_path, packed):
    folder = tmp_path / "metadata" / "t"
    folder.mkdir(parents=True)
    names = [_stored(tmp_path, FrameRef(patched.path)), _stored(tmp_path, patched)]
    write_frame_names(folder, names, packed=packed)
    frames = read_shared_frames(folder, [3, 5], {})
    assert list(frames) == [3, 5]
    assert frames[3] == FrameRef(tmp_path / "frames" / f"{names[0]}.png")
    assert frames[5].load().tobytes() == patched.load().tobytes()
    assert frames[5].digest == patched.digest


NAME = "0" * 32


@pytest.mark.parametrize(
    "line",
    [
        "",
        f"{NAME} {NAME}",
        f"{NAME} {NAME}@1",
        f"{NAME} {NAME}@-1,2",
        f"{NAME} {NAME}@1,2 ",
        f"{NAME}@1,2",
        f"{NAME} ../../secret@1,2",
        f"{NAME} {NAME}@1234567,2",
    ],
)
def test_a_wrong_line_is_refused(line, tmp_path):
    write_frame_names(tmp_path, [line])
    with pytest.raises(DataError, match=re.escape(f"{line!r} is not the name of a picture")):
        read_shared_frames(tmp_path, [0], {})


@pytest.mark.parametrize("content", [b"x", b""])
def test_a_damaged_packed_list_is_refused(tmp_path, content):
    write_frame_names(tmp_path, [NAME], packed=True)
    path = tmp_path / "frames.txt.xz"
    path.write_bytes(content or path.read_bytes()[:-10])
    with pytest.raises(DataError, match=r"frames\.txt\.xz: cannot be unpacked"):
        read_shared_frames(tmp_path, [0], {})
