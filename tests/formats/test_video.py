import numpy as np
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.user_cache import user_cache
from infthor_eval.formats.video import frames_per_second


def greys(frames):
    """Mean grey level of each frame; a lossy codec moves it a little."""
    return [float(np.asarray(frame.load()).mean()) for frame in frames]


@pytest.mark.parametrize(("fps", "expected"), [(10, (0, 10, 20, 30)), (25, (0, 25)), (29.97, (0, 30)), (1, range(36))])
def test_one_frame_per_second_is_taken_the_nearest_to_it(write_video, tmp_path, fps, expected):
    path = tmp_path / "a.mp4"
    write_video(path, [7 * index for index in range(36)], fps=fps)
    frames = frames_per_second(path)
    assert greys(frames) == pytest.approx([7 * index for index in expected], abs=3)
    assert {frame.load().size for frame in frames} == {(64, 64)}


def test_a_video_is_decoded_once_and_again_only_when_it_has_changed(write_video, tmp_path, monkeypatch):
    path, moved = tmp_path / "a.mp4", tmp_path / "b.mp4"
    write_video(path, [10] * 25)
    first = frames_per_second(path)
    path.rename(moved)
    with monkeypatch.context() as patch:
        patch.setattr("cv2.VideoCapture", None)
        assert frames_per_second(moved) == first
    write_video(moved, [200] * 25)
    changed = frames_per_second(moved)
    assert greys(changed) == pytest.approx([200] * 3, abs=3)
    assert {frame.digest for frame in changed}.isdisjoint(frame.digest for frame in first)


def test_frames_that_were_cleaned_away_are_decoded_again(write_video, tmp_path):
    write_video(tmp_path / "a.mp4", range(0, 250, 5))
    first = frames_per_second(tmp_path / "a.mp4")
    first[-1].path.unlink()
    again = frames_per_second(tmp_path / "a.mp4")
    assert len(first) == 5
    assert [frame.digest for frame in again[:-1]] == [frame.digest for frame in first[:-1]]
    assert again[-1].path.is_file()


def damaged(content):
    """Zeros where the last two thirds of the pictures are, the index behind them whole."""
    start, end = content.find(b"mdat") + 4, content.find(b"moov")
    keep = start + (end - start) // 3
    return content[:keep] + bytes(end - keep) + content[end:]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda content: b"no video", "not a video that OpenCV can decode"),
        (lambda content: content[: len(content) // 2], "not a video that OpenCV can decode"),
        (damaged, r"only \d+ of its 60 frames can be decoded"),
    ],
)
def test_a_broken_video_is_one_line_and_leaves_nothing_behind(write_video, tmp_path, capfd, spoil, said):
    path = tmp_path / "a.mp4"
    write_video(path, [4 * index for index in range(60)])
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(DataError, match=f"a.mp4: {said}.*delete it to show the frames instead"):
        frames_per_second(path)
    assert capfd.readouterr() == ("", "")
    assert list(user_cache("video_frames").iterdir()) == []


def test_a_cache_that_cannot_be_written_is_named(write_video, tmp_path, monkeypatch):
    write_video(tmp_path / "a.mp4", [0] * 10)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(DataError, match=r"cannot be written .*set XDG_CACHE_HOME"):
        frames_per_second(tmp_path / "a.mp4")
