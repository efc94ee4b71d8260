"""Films of a data set of one's own: their sampled frames, and which of these some seconds mean."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.pictures.video import read_video

FILM_SUFFIXES = (".mp4", ".webm", ".mkv", ".mov", ".avi")
_RATE = 1.0  # frames per second to sample
_SLACK = 1.0  # seconds that an annotation may be after the end: players round the length of a film
_SPAN = re.compile(r"(\d+(?:\.\d*)?)(?:\s*-\s*(\d+(?:\.\d*)?))?", re.ASCII)


@dataclass(frozen=True)
class SampledFilm:
    """Frames that stand for a film.

    Attributes:
        folder: folder of the frames, in the user's cache.
        times: when each of them is shown, seconds from the film's first frame, ascending.
        seconds: length of the film.
    """

    folder: Path
    times: Sequence[float]
    seconds: float

    def frames_at(self, cell: str) -> tuple[int, ...]:
        """Return the places of the frames that a cell means, as in "12.5, 14-16".

        Of a range that is all frames in it, else the nearest one; of two as near, the first.
        """
        places: dict[int, None] = {}  # a set in order
        for part in map(str.strip, cell.split(",")):
            match = _SPAN.fullmatch(part)
            if match is None:
                raise DataError(f"{part!r:.40} is no number of seconds; write 12.5 or 12-14")
            start, end = float(match[1]), float(match[2] or match[1])
            if end < start:
                raise DataError(f"{part!r:.40} ends before it starts; write it as in 12-14")
            if end > self.seconds + _SLACK:
                raise DataError(
                    f"{part!r:.40} is after the end of the film; write seconds from 0 to "
                    f"{self.seconds:.1f}"
                )
            gaps = [max(start - time, time - end, 0.0) for time in self.times]
            nearest = min(gaps)
            found = [place for place, gap in enumerate(gaps) if gap == nearest]
            places |= dict.fromkeys(found if nearest == 0 else found[:1])
        return tuple(places)


def sample_film(path: Path) -> SampledFilm | DataError:
    """Return the frames of a film, 1 a second (at least 4, at most 768), or why it has none.

    Times are right where a film has the same number of frames in every second.
    """
    try:
        video = read_video(path, _RATE)
    except DataError as error:
        # Without its folder: reasons are in a run's identity.
        reason = str(error).replace(str(path), path.name).partition(";")[0]
        return DataError(f"{reason}; write the film again, as MP4 with H.264")
    files = [Path(str(frame.path)) for frame in video.frames]
    positions = [int(file.stem) for file in files]
    # The last frame of a film is always sampled, so that its place tells how many there are.
    n_frames = positions[-1] + 1
    film_fps = video.fps * n_frames / len(positions)
    times = [round(position / film_fps, 6) for position in positions]
    return SampledFilm(files[0].parent, times, n_frames / film_fps)
