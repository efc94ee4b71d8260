import numpy as np
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video, read_video, sample_positions
from infthor_eval.storage.folders import user_cache


def greys(frames):
    """Mean grey level of each frame; a lossy codec moves it a little."""
    return [float(np.asarray(frame.load()).mean()) for frame in frames]


@pytest.mark.parametrize(
    ("n_frames", "film_fps", "fps", "expected"),
    [
        # By qwen-vl-utils 0.0.14: smart_nframes, then linspace(0, n - 1).round().
        (36, 10, 1, (0, 12, 23, 35)),  # 3.6 frames, at least 4
        (60, 10, 1, (0, 12, 24, 35, 47, 59)),
        (60, 25, 2, (0, 20, 39, 59)),  # 4.8 frames, rounded down to even
        (7, 1, 1, (0, 1, 2, 4, 5, 6)),
        (3, 10, 1, (0, 2)),
        (2, 10, 2, (0, 1)),
        (1, 10, 1, (0,)),
    ],
)
def test_frames_are_sampled_as_published(n_frames, film_fps, fps, expected):
    assert sample_positions(n_frames, film_fps, fps) == expected


def test_at_most_768_frames_are_sampled():
    assert len(sample_positions(10_000, 10, 10)) == 768


@pytest.mark.parametrize(("film_fps", "fps"), [(10, 1), (10, 2), (25, 4), (29.97, 3)])
def test_sampled_frames_are_those_of_the_film_and_the_rate_is_theirs(
    write_video, tmp_path, film_fps, fps
):
    path = tmp_path / "a.mp4"
    write_video(path, [7 * index for index in range(36)], fps=film_fps)
    sampled, expected = read_video(path, fps), sample_positions(36, film_fps, fps)
    assert greys(sampled.frames) == pytest.approx([7 * index for index in expected], abs=3)
    assert {frame.load().size for frame in sampled.frames} == {(64, 64)}
    assert sampled.fps == pytest.approx(len(expected) / 36 * film_fps)


def test_rates_of_one_film_are_kept_apart(write_video, tmp_path):
    write_video(tmp_path / "a.mp4", range(0, 240, 3))
    assert [len(read_video(tmp_path / "a.mp4", fps).frames) for fps in (1, 2, 1)] == [8, 16, 8]


def test_a_video_is_decoded_once_and_again_only_when_it_has_changed(
    write_video, tmp_path, monkeypatch
):
    path, moved = tmp_path / "a.mp4", tmp_path / "b.mp4"
    write_video(path, [10] * 25)
    first = read_video(path, 1)
    path.rename(moved)
    with monkeypatch.context() as patch:
        patch.setattr("cv2.VideoCapture", None)
        assert read_video(moved, 1) == first
    write_video(moved, [200] * 25)
    changed = read_video(moved, 1)
    assert greys(changed.frames) == pytest.approx([200] * 4, abs=3)
    assert {frame.digest for frame in changed.frames}.isdisjoint(
        frame.digest for frame in first.frames
    )


def test_frames_that_were_cleaned_away_are_decoded_again(write_video, tmp_path):
    write_video(tmp_path / "a.mp4", range(0, 250, 5))
    first = read_video(tmp_path / "a.mp4", 1).frames
    first[-1].path.unlink()
    again = read_video(tmp_path / "a.mp4", 1).frames
    assert len(first) == 4
    assert [frame.digest for frame in again[:-1]] == [frame.digest for frame in first[:-1]]
    assert again[-1].path.is_file()


def damaged(content):
    """Zeros where the last two thirds of the pictures are, the index behind them whole."""
    start, end = content.find(b"mdat") + 4, content.find(b"moov")
    keep = start + (end - start) // 3
    return content[:keep] + bytes(end - keep) + content[end:]


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda content: b"no video", "not a video that OpenCV can decode"),
        (lambda content: content[: len(content) // 2], "not a video that OpenCV can decode"),
        (damaged, r"only \d+ of its 60 frames can be decoded"),
    ],
)
def test_a_broken_video_is_one_line_and_leaves_nothing_behind(
    write_video, tmp_path, capfd, spoil, expected
):
    path = tmp_path / "a.mp4"
    write_video(path, [4 * index for index in range(60)])
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(DataError, match=f"a.mp4: {expected}.*delete it to show the frames instead"):
        read_video(path, 1)
    assert capfd.readouterr() == ("", "")
    assert list(user_cache("video_frames").iterdir()) == []


def test_a_cache_that_cannot_be_written_is_named(write_video, tmp_path, monkeypatch):
    write_video(tmp_path / "a.mp4", [0] * 10)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(DataError, match=r"cannot be written .*set XDG_CACHE_HOME"):
        read_video(tmp_path / "a.mp4", 1)


@pytest.mark.parametrize(("n_frames", "fps"), [(0, 1.0), (1, 0.0), (1, float("nan"))])
def test_a_video_has_frames_and_a_rate(tmp_path, n_frames, fps):
    with pytest.raises(ValueError, match="a video has frames and a rate above 0"):
        Video((FrameRef(tmp_path / "a.png"),) * n_frames, fps)
