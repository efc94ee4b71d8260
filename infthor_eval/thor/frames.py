"""Where an agent's frames are kept while it acts."""

from pathlib import Path
from typing import Protocol

from PIL import Image

from infthor_eval.errors import DataError, SimulatorError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.thor.view import SimulatorView

__all__ = ["FrameFolder", "FrameKeeper", "NoFrames"]


class FrameKeeper(Protocol):
    """Makes a reference of what the agent sees."""

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """The frame of a view; None where nobody looks.

        Raises:
            SimulatorError: the view has none.
            DataError: it cannot be written.
        """
        ...


class NoFrames:
    """For agents that do not look."""

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """None."""
        return None


class FrameFolder:
    """PNG files of a folder that exists."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._n_frames = 0

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """See `FrameKeeper`."""
        if view.frame is None:
            raise SimulatorError("the simulator sent no frame; start it with rendering on")
        path = self._folder / f"{self._n_frames:09d}.png"
        self._n_frames += 1
        try:
            Image.fromarray(view.frame).save(path, compress_level=1)
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error.strerror}); make room, or set TMPDIR") from error
        return FrameRef(path)
