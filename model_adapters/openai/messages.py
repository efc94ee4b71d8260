"""A conversation as a server takes it: messages of texts and images."""

import base64
from collections import OrderedDict
from collections.abc import Sequence
from io import BytesIO
from threading import Lock
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.protocols import Part, Turn

__all__ = ["EncodedFrames", "messages_of"]

_KEPT = 256 * 2**20  # bytes of encoded frames: a few thousand of the published size
_SETTINGS: dict[str, dict[str, Any]] = {"png": {"compress_level": 6}, "jpeg": {"quality": 95, "subsampling": 0}}


class EncodedFrames:
    """Frames as `data:` addresses, each encoded once by its content as long as there is room; for several threads.

    Args:
        image_format: "png" or "jpeg".
        room: bytes of what is kept; what was used longest ago makes place.
    """

    def __init__(self, image_format: str, room: int = _KEPT) -> None:
        self._format = image_format
        self._room = room
        self._kept: OrderedDict[str, str] = OrderedDict()
        self._size = 0
        self._lock = Lock()

    def address(self, frame: FrameRef) -> str:
        """The frame in an address, the same one whenever it is asked.

        Raises:
            DataError: the frame cannot be read.
        """
        with self._lock:  # while it is encoded too: threads that show the same frames wait for one of them to do it
            found = self._kept.get(frame.digest)
            if found is None:
                found = self._encoded(frame)
                self._kept[frame.digest] = found
                self._size += len(found)
            self._kept.move_to_end(frame.digest)
            while self._size > self._room and len(self._kept) > 1:
                _, dropped = self._kept.popitem(last=False)
                self._size -= len(dropped)
            return found

    def _encoded(self, frame: FrameRef) -> str:
        """From its pixels, not its file: what else a file holds (a palette, transparency) is read in many ways."""
        content = BytesIO()
        frame.load().save(content, self._format, **_SETTINGS[self._format])
        return f"data:image/{self._format};base64,{base64.b64encode(content.getvalue()).decode('ascii')}"


def messages_of(name: str, turns: Sequence[Turn], frames: EncodedFrames, detail: str | None) -> list[dict[str, Any]]:
    """The messages of a conversation, texts and frames in their order.

    Args:
        name: of the model, for the message.
        turns: the conversation.
        frames: encodes them.
        detail: sent with every frame where it is given.

    Raises:
        DataError: a frame cannot be read.
        ModelError: a frame in a turn that is not the user's, which no server takes.
    """
    return [{"role": turn.role, "content": _content(name, turn, frames, detail)} for turn in turns]


def _content(name: str, turn: Turn, frames: EncodedFrames, detail: str | None) -> str | list[dict[str, Any]]:
    if all(isinstance(part, str) for part in turn.parts):  # some servers take nothing else of the system
        return "".join(map(str, turn.parts))
    if turn.role != "user":
        raise ModelError(f"{name} is shown frames by the user alone, not by the {turn.role}; put them in a user turn")
    return [_part(part, frames, detail) for part in turn.parts]


def _part(part: Part, frames: EncodedFrames, detail: str | None) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    image = {"url": frames.address(part)} | ({} if detail is None else {"detail": detail})
    return {"type": "image_url", "image_url": image}
