"""Conversations as messages, and frames in them."""

import base64
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Turn
from model_adapters.served.frames import EncodedFrames
from model_adapters.served.openai import to_messages


def _pixels(address):
    return np.asarray(
        Image.open(BytesIO(base64.b64decode(address.partition(",")[2]))).convert("RGB")
    )


def test_texts_and_frames_keep_their_order(frames):
    encoded = EncodedFrames("png")
    turns = (
        Turn("system", ("Be brief.",)),
        Turn("user", ("Look: ", frames[0], "and", frames[1])),
        Turn("assistant", ("A mug.",)),
        Turn("user", ("Where?",)),
    )
    first, second = (
        {"type": "image_url", "image_url": {"url": encoded.url(frame), "detail": "low"}}
        for frame in frames[:2]
    )
    assert to_messages("m", turns, encoded, "low") == [
        {"role": "system", "content": "Be brief."},
        {
            "role": "user",
            "content": [
                {"type": "text", "text": "Look: "},
                first,
                {"type": "text", "text": "and"},
                second,
            ],
        },
        {"role": "assistant", "content": "A mug."},
        {"role": "user", "content": "Where?"},
    ]


@pytest.mark.parametrize("role", ["system", "assistant"])
def test_frames_are_the_users_alone(role, frames):
    with pytest.raises(
        ModelError, match=f"m accepts frames in user turns only, not in a turn of the {role}"
    ):
        to_messages("m", (Turn(role, (frames[0],)),), EncodedFrames("png"), None)


def test_png_loses_nothing_and_jpeg_little_and_both_are_the_same_bytes_each_time(frames):
    seen = np.asarray(frames[0].load())
    png, jpeg = EncodedFrames("png").url(frames[0]), EncodedFrames("jpeg").url(frames[0])
    assert png.startswith("data:image/png;base64,")
    assert jpeg.startswith("data:image/jpeg;base64,")
    assert (_pixels(png) == seen).all()
    assert 0 < np.abs(_pixels(jpeg).astype(int) - seen).mean() < 4
    assert EncodedFrames("png").url(frames[0]) == png
    assert EncodedFrames("jpeg").url(frames[0]) == jpeg


def test_a_frame_is_encoded_once_by_its_content(tmp_path, frames, monkeypatch):
    twin = FrameRef(tmp_path / "twin.png")
    twin.path.write_bytes(frames[0].path.read_bytes())
    loaded, load = [], FrameRef.load
    monkeypatch.setattr(FrameRef, "load", lambda frame: loaded.append(frame) or load(frame))
    encoded = EncodedFrames("png")
    assert len({encoded.url(frame) for frame in (frames[0], twin, FrameRef(frames[0].path))}) == 1
    assert len(loaded) == 1


def test_no_more_is_kept_than_there_is_room_for(frames, monkeypatch):
    sizes = [len(EncodedFrames("png").base64(frame)) for frame in frames[:3]]
    encoded = EncodedFrames("png", max_bytes=sum(sizes) - 1)
    loaded, load = [], FrameRef.load
    monkeypatch.setattr(FrameRef, "load", lambda frame: loaded.append(frame) or load(frame))
    for frame in (frames[0], frames[1], frames[0], frames[2], frames[0], frames[1]):
        encoded.url(frame)
    # What was used longest ago made place.
    assert loaded == [frames[0], frames[1], frames[2], frames[1]]


def test_a_frame_that_cannot_be_read_is_a_fault_of_the_data(tmp_path):
    with pytest.raises(DataError):
        EncodedFrames("png").url(FrameRef(tmp_path / "none.png"))
