"""Frames as servers take them: encoded once, in base64."""

import base64
from collections import OrderedDict
from io import BytesIO
from threading import Lock
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Turn

_CACHE_BYTES = 256 * 2**20  # of encoded frames: a few thousand of the published size
_SETTINGS: dict[str, dict[str, Any]] = {
    "png": {"compress_level": 6},
    "jpeg": {"quality": 95, "subsampling": 0},
}


class EncodedFrames:
    """A cache of frames in base64 by the digest of their content, for several threads.

    The format is "png" or "jpeg". Beyond `max_bytes`, the least recently used frames are dropped.
    """

    def __init__(self, image_format: str, max_bytes: int = _CACHE_BYTES) -> None:
        self._format = image_format
        self._max_bytes = max_bytes
        self._cache: OrderedDict[str, str] = OrderedDict()
        self._size = 0
        self._lock = Lock()

    @property
    def media_type(self) -> str:
        """The type of all frames, as in HTTP."""
        return f"image/{self._format}"

    def url(self, frame: FrameRef) -> str:
        """Return the frame as a `data:` URL; see `base64`."""
        return f"data:{self.media_type};base64,{self.base64(frame)}"

    def base64(self, frame: FrameRef) -> str:
        """Return the frame in base64, always the same for the same frame."""
        # Held while encoding: threads with the same frames wait instead of encoding them again.
        with self._lock:
            encoded = self._cache.get(frame.digest)
            if encoded is None:
                encoded = self._encode(frame)
                self._cache[frame.digest] = encoded
                self._size += len(encoded)
            self._cache.move_to_end(frame.digest)
            while self._size > self._max_bytes and len(self._cache) > 1:
                _, dropped = self._cache.popitem(last=False)
                self._size -= len(dropped)
            return encoded

    def _encode(self, frame: FrameRef) -> str:
        """Encode the pixels, not the file: servers read palettes and transparency in many ways."""
        content = BytesIO()
        frame.load().save(content, self._format, **_SETTINGS[self._format])
        return base64.b64encode(content.getvalue()).decode("ascii")


def require_user_frames(name: str, turn: Turn) -> None:
    """Refuse frames in a turn other than the user's, which no server takes (ModelError)."""
    if turn.role != "user" and any(isinstance(part, FrameRef) for part in turn.parts):
        raise ModelError(
            f"{name} accepts frames in user turns only, not in a turn of the {turn.role}; move them"
        )
