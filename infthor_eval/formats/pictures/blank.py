"""Blank frames for the frame ablation: plain grey, of the size of the frames that they replace."""

from pathlib import Path

from PIL import Image

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.files import write_atomically, writing_hint
from infthor_eval.storage.folders import user_cache

_GREY = (128, 128, 128)


def blank_like(frame: FrameRef) -> FrameRef:
    """Return a plain grey frame of the same size, which costs a model as many tokens.

    One file per size is kept in the user's cache. A frame that cannot be read is returned as it is:
    reading its pixels then raises the error that says what is wrong with it.
    """
    try:
        size = frame.size
    except DataError:
        return frame
    path = user_cache("blank_frames") / f"{size[0]}x{size[1]}.png"
    if not path.is_file():
        with wrap_errors(f"{path}: cannot be written", writing_hint(", or set XDG_CACHE_HOME")):
            _write(path, size)
    return FrameRef(path)


def _write(path: Path, size: tuple[int, int]) -> None:
    """Write the file atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_atomically(path) as partial:
        Image.new("RGB", size, _GREY).save(partial, format="PNG")
