"""Frames read ahead of a model change no reply, and a broken one fails its question only."""

import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters import load

from ..asking import talk_of, up_to, user


def _reply(model, *frames):
    return str(talk_of(model, user(*frames, "What is it?")).reply(up_to(4)).text)


@pytest.mark.parametrize("name", ["qwen2.5-vl-tiny", "llava-onevision-tiny"])
def test_replies_are_those_of_frames_read_when_they_are_asked_for(name, frames, make_frames):
    # One twice, two of another size.
    shown = [*frames, frames[1], *make_frames(2, width=80, height=40)]
    replies = set()
    for n_threads, memory in (("0", "256"), ("3", "256"), ("2", "0")):
        model = load(
            name, {"frame_threads": n_threads, "frames_ahead_mb": memory, "chunk_tokens": "64"}, 0
        )
        identity = model.identity()
        replies.add((_reply(model, *shown), str(identity)))
        model.close()
    assert len(replies) == 1


def test_a_broken_frame_fails_its_question_only(frames, tmp_path):
    content = frames[2].path.read_bytes()
    broken = FrameRef(tmp_path / "broken.png")
    broken.path.write_bytes(content[: len(content) - 60])  # its size can be read
    model = load("qwen2.5-vl-tiny", {"frame_threads": "3", "chunk_tokens": "24"}, 0)
    expected = _reply(model, *frames)
    model.forget()
    with pytest.raises(DataError, match=r"broken\.png: not a readable image"):
        _reply(model, *frames[:3], broken, *frames[3:])
    assert _reply(model, *frames) == expected
    model.close()


def test_options_are_checked():
    with pytest.raises(UsageError, match="frame_threads=-1: give a whole number from 0"):
        load("qwen2.5-vl-tiny", {"frame_threads": "-1"}, 0)
    with pytest.raises(UsageError, match="frames_ahead_mb"):
        load("qwen2.5-vl-tiny", {"frames_ahead_mb": "-1"}, 0)
