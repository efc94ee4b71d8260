"""Conversations as messages of OpenAI's chat completions."""

from collections.abc import Sequence
from typing import Any

from infthor_eval.formats.pictures.video import Video
from model_adapters.protocols import Part, Turn
from model_adapters.served.frames import EncodedFrames, require_user_frames


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
    require_user_frames(name, turn)
    return [_part(part, frames, detail) for part in turn.parts]


def _part(part: Part, frames: EncodedFrames, detail: str | None) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": "text", "text": part}
    assert not isinstance(part, Video)  # `check_turns` refuses it
    image = {"url": frames.url(part)} | ({} if detail is None else {"detail": detail})
    return {"type": "image_url", "image_url": image}
