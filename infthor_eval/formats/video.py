"""Frames of videos, as references like other frames.

Models need single frames, some repeatedly, but a video can only be decoded from its start. So the sampled frames are
decoded in one pass and stored in the user's cache under the video's digest.
"""

import os
import shutil
import tempfile
from pathlib import Path

from PIL import Image

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.digests import digest_of_file
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.reading import require_file
from infthor_eval.formats.user_cache import user_cache

__all__ = ["frames_per_second"]

# Silences FFmpeg, which prints errors of its own beside our one-line error. OpenCV reads the level when it first uses
# FFmpeg, so it is set on import.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

_COUNT = "n_frames"  # file with the number of frames
_HINT = "create the video again, or delete it to show the frames instead"


def frames_per_second(path: Path) -> tuple[FrameRef, ...]:
    """Return one frame per second of a video: the frames nearest to 0 s, 1 s, 2 s, ...

    OpenCV decodes the video at the first call for its content. The name of the cache folder has the digest of the
    content and the version of the decoder.

    Raises:
        DataError: the video cannot be decoded to its end, or its frames cannot be stored.
    """
    import cv2

    require_file(path, _HINT)
    with wrap_errors(f"{path}: cannot be read", _HINT):
        digest = digest_of_file(path)
    folder = user_cache("video_frames") / f"{digest}-1fps-opencv{cv2.__version__}"
    if not _is_complete(folder):
        with wrap_errors(f"{folder}: cannot be written", "make room, or set XDG_CACHE_HOME"):
            _extract(path, folder)
    return tuple(FrameRef(file) for file in sorted(folder.glob("*.png")))


def _is_complete(folder: Path) -> bool:
    """Return False also if frames were deleted later, as programs that clean caches do."""
    count = folder / _COUNT
    return count.is_file() and count.read_text() == str(len(list(folder.glob("*.png"))))


def _extract(path: Path, folder: Path) -> None:
    """Decode the frames into a temporary folder and rename it when it is complete."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix="partial-") as partial:
        frames = Path(partial) / "frames"
        frames.mkdir()
        _decode(path, frames)
        try:
            frames.rename(folder)
        except OSError:
            if not _is_complete(folder):  # otherwise another process was faster
                raise


def _decode(path: Path, folder: Path) -> None:
    import cv2

    video = cv2.VideoCapture(str(path))
    try:
        fps, promised = video.get(cv2.CAP_PROP_FPS), int(video.get(cv2.CAP_PROP_FRAME_COUNT))
        if not video.isOpened() or not fps > 0:
            raise DataError(f"{path}: not a video that OpenCV can decode; {_HINT}")
        n_frames = n_sampled = 0
        while video.grab():
            if n_frames >= n_sampled * fps - 0.5:  # the frame nearest to second `n_sampled`
                decoded, pixels = video.retrieve()
                if not decoded:
                    raise DataError(f"{path}: frame {n_frames} cannot be decoded; {_HINT}")
                Image.fromarray(pixels[:, :, ::-1]).save(folder / f"{n_sampled:09d}.png")
                n_sampled += 1
            n_frames += 1
    finally:
        video.release()
    # The number in the header can be an estimate, so a second less is no error.
    if not n_sampled or n_frames < promised - fps:
        raise DataError(f"{path}: only {n_frames} of its {promised} frames can be decoded; {_HINT}")
    (folder / _COUNT).write_text(str(n_sampled))
