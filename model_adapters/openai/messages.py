"""Conversations as messages of OpenAI's chat completions."""

import base64
from collections import OrderedDict
from collections.abc import Sequence
from io import BytesIO
from threading import Lock
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Part, Turn, Video

__all__ = ["EncodedFrames", "to_messages"]

_CACHE_BYTES = 256 * 2**20  # of encoded frames: a few thousand of the published size
_SETTINGS: dict[str, dict[str, Any]] = {
    "png": {"compress_level": 6},
    "jpeg": {"quality": 95, "subsampling": 0},
}


class EncodedFrames:
    """A cache of frames as `data:` URLs by the digest of their content, for several threads.

    The format is "png" or "jpeg". Beyond `max_bytes`, the least recently used frames are dropped.
    """

    def __init__(self, image_format: str, max_bytes: int = _CACHE_BYTES) -> None:
        self._format = image_format
        self._max_bytes = max_bytes
        self._cache: OrderedDict[str, str] = OrderedDict()
        self._size = 0
        self._lock = Lock()

    def url(self, frame: FrameRef) -> str:
        """Return the frame as a URL, which is always the same for the same frame.

        Raises:
            DataError: the frame cannot be read.
        """
        # Held while encoding: threads with the same frames wait instead of encoding them again.
        with self._lock:
            url = self._cache.get(frame.digest)
            if url is None:
                url = self._encode(frame)
                self._cache[frame.digest] = url
                self._size += len(url)
            self._cache.move_to_end(frame.digest)
            while self._size > self._max_bytes and len(self._cache) > 1:
                _, dropped = self._cache.popitem(last=False)
                self._size -= len(dropped)
            return url

    def _encode(self, frame: FrameRef) -> str:
        """Encode the pixels, not the file: servers read palettes and transparency in many ways."""
        content = BytesIO()
        frame.load().save(content, self._format, **_SETTINGS[self._format])
        encoded = base64.b64encode(content.getvalue()).decode("ascii")
        return f"data:image/{self._format};base64,{encoded}"


def to_messages(
    name: str, turns: Sequence[Turn], frames: EncodedFrames, detail: str | None
) -> list[dict[str, Any]]:
    """Return a conversation's messages, with texts and frames in order; each frame has this
    `detail` unless it is None.

    Raises:
        DataError: a frame cannot be read.
        ModelError: a turn other than the user's has a frame, which no server supports.
    """
    return [{"role": turn.role, "content": _content(name, turn, frames, detail)} for turn in turns]


def _content(
    name: str, turn: Turn, frames: EncodedFrames, detail: str | None
) -> str | list[dict[str, Any]]:
    # Some servers accept only a string in system turns.
    if all(isinstance(part, str) for part in turn.parts):
        return "".join(map(str, turn.parts))
    if turn.role != "user":
        raise ModelError(
            f"{name} accepts frames in user turns only, not in a turn of the {turn.role}; move them"
        )
    return [_part(part, frames, detail) for part in turn.parts]


def _part(part: Part, frames: EncodedFrames, detail: str | None) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    assert not isinstance(part, Video)  # `check_turns` refuses it
    image = {"url": frames.url(part)} | ({} if detail is None else {"detail": detail})
    return {"type": "image_url", "image_url": image}
