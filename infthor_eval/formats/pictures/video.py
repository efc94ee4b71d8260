"""Videos as models are given them: some frames of a film, as references like other frames.

Frames are sampled as qwen-vl-utils does it, which the published evaluation used. Models need single
frames, some repeatedly, but a film can only be decoded from its start. So the sampled frames are
decoded together and stored in the user's cache under the film's digest.
"""

import json
import math
import os
import shutil
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from infthor_eval.errors import DataError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.formats.reading import require_file
from infthor_eval.storage.digests import digest, digest_of_file
from infthor_eval.storage.files import writing_hint
from infthor_eval.storage.folders import user_cache
from infthor_eval.storage.scratch import ScratchFolder

FILM_FPS = 10  # of the published films, whose frames are those of a trajectory

# Silences FFmpeg, which prints errors of its own beside our one-line error. OpenCV reads the level
# when it first uses FFmpeg, so it is set on import.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# Limits of qwen-vl-utils (FPS_MIN_FRAMES, FPS_MAX_FRAMES, FRAME_FACTOR).
_FEWEST_FRAMES = 4
_MOST_FRAMES = 768
_FACTOR = 2

_SAMPLED = "sampled.json"  # file with the number of frames and their rate
_HINT = "create the video again, or delete it to show the frames instead"


@dataclass(frozen=True)
class Video:
    """Frames sampled from a film, in time order.

    Attributes:
        frames: references to the frames, at least one.
        fps: sampled frames per second of the film, above 0.
    """

    frames: tuple[FrameRef, ...]
    fps: float

    def __post_init__(self) -> None:
        """Raise ValueError if there is no frame, or the rate is not above 0."""
        if not self.frames or not self.fps > 0:
            raise ValueError(
                f"a video has frames and a rate above 0, not {len(self.frames)} frames at "
                f"{self.fps} fps"
            )


def sample_positions(n_frames: int, film_fps: float, fps: float) -> tuple[int, ...]:
    """Return the positions of the frames sampled from a film, ascending, as by qwen-vl-utils.

    There are `n_frames / film_fps * fps` of them, at least 4 and at most 768, rounded down to an
    even number, and evenly spread from the first frame to the last. Of a film of one frame, which
    qwen-vl-utils refuses, it is taken.

    Args:
        n_frames: frames of the film, at least 1.
        film_fps: its frames per second.
        fps: frames per second to sample.
    """
    wanted = max(n_frames / film_fps * fps, _FEWEST_FRAMES)
    n = math.floor(min(wanted, _MOST_FRAMES, n_frames) / _FACTOR) * _FACTOR
    return tuple(round(rank * (n_frames - 1) / (n - 1)) for rank in range(n)) or (0,)


def read_video(path: SetPath, fps: float) -> Video:
    """Return the frames that are sampled from a film at this rate.

    OpenCV decodes the film at the first call for its content and the rate. The name of the cache
    folder has the digest of the content, the rate and the version of the decoder.
    """
    import cv2

    require_file(path, _HINT)
    with wrap_errors(f"{path}: cannot be read", _HINT):
        # In pieces where it can be: films of one's own may be larger than the memory.
        content = digest_of_file(path) if isinstance(path, Path) else digest(path.read_bytes())
    folder = user_cache("video_frames") / f"{content}-spread-{fps:g}fps-opencv{cv2.__version__}"
    if not _is_complete(folder):
        with wrap_errors(f"{folder}: cannot be written", writing_hint(", or set XDG_CACHE_HOME")):
            _extract(path, fps, folder)
    sampled = json.loads((folder / _SAMPLED).read_text())
    return Video(tuple(FrameRef(file) for file in sorted(folder.glob("*.png"))), sampled["fps"])


def _is_complete(folder: Path) -> bool:
    """Return False also if frames were deleted later, as programs that clean caches do."""
    sampled = folder / _SAMPLED
    return sampled.is_file() and json.loads(sampled.read_text())["n_frames"] == len(
        list(folder.glob("*.png"))
    )


def _extract(path: SetPath, fps: float, folder: Path) -> None:
    """Decode the frames into a temporary folder and rename it when it is complete."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with ScratchFolder(folder.parent) as scratch:
        frames = scratch / "frames"
        frames.mkdir()
        film = path if isinstance(path, Path) else scratch / path.name
        if not isinstance(path, Path):  # OpenCV reads files alone
            film.write_bytes(path.read_bytes())
        _decode(film, fps, frames)
        try:
            frames.rename(folder)
        except OSError:
            if not _is_complete(folder):  # otherwise another process was faster
                raise


def _decode(path: Path, fps: float, folder: Path) -> None:
    film_fps, promised = _header(path)
    positions = sample_positions(max(promised, 1), film_fps, fps)
    n_frames = _store(path, positions, folder)
    # The number in the header can be an estimate, so a second less is no error.
    if not n_frames or n_frames < promised - film_fps:
        raise DataError(f"{path}: only {n_frames} of its {promised} frames can be decoded; {_HINT}")
    if n_frames != promised:
        for file in folder.iterdir():
            file.unlink()
        positions = sample_positions(n_frames, film_fps, fps)
        _store(path, positions, folder)
    sampled = {"n_frames": len(positions), "fps": len(positions) / n_frames * film_fps}
    (folder / _SAMPLED).write_text(json.dumps(sampled))


def _header(path: Path) -> tuple[float, int]:
    """Return the frames per second of a film, and their number if the header is right."""
    import cv2

    film = cv2.VideoCapture(str(path))
    try:
        film_fps = film.get(cv2.CAP_PROP_FPS)
        promised = int(film.get(cv2.CAP_PROP_FRAME_COUNT))
        if not film.isOpened() or not film_fps > 0:
            raise DataError(f"{path}: not a video that OpenCV can decode; {_HINT}")
    finally:
        film.release()
    return film_fps, promised


def _store(path: Path, positions: Collection[int], folder: Path) -> int:
    """Store the frames at these positions; return the number of frames of the film."""
    import cv2

    film = cv2.VideoCapture(str(path))
    wanted = set(positions)
    n_frames = 0
    try:
        while film.grab():
            if n_frames in wanted:
                decoded, pixels = film.retrieve()
                if not decoded:
                    raise DataError(f"{path}: frame {n_frames} cannot be decoded; {_HINT}")
                Image.fromarray(pixels[:, :, ::-1]).save(folder / f"{n_frames:09d}.png")
            n_frames += 1
    finally:
        film.release()
    return n_frames
