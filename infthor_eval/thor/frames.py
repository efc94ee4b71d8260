"""Storing the frames of an acting agent."""

from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from infthor_eval.errors import SimulatorError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.png import write_png
from infthor_eval.storage.files import writing_hint
from infthor_eval.thor.view import SimulatorView


class FrameKeeper(Protocol):
    """Stores frames and returns references to them."""

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """Store the frame of a state; returns None for an agent without vision.

        Raises:
            SimulatorError: the simulator sent no frame.
            DataError: the frame cannot be written.
        """

    def keep_from(self, camera: int, view: SimulatorView) -> FrameRef | None:
        """Store the frame of a third-party camera, likewise."""


class NoFrames:
    """Frames of agents without vision: none is stored."""

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """Return None."""
        return None

    def keep_from(self, camera: int, view: SimulatorView) -> FrameRef | None:
        """Return None."""
        return None


class FrameFolder:
    """Frames as PNG files in an existing folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._n_frames = 0

    def keep(self, view: SimulatorView) -> FrameRef | None:
        """See `FrameKeeper`."""
        if view.frame is None:
            raise SimulatorError("the simulator sent no frame; start it with rendering on")
        return self._write(view.frame)

    def keep_from(self, camera: int, view: SimulatorView) -> FrameRef | None:
        """See `FrameKeeper`."""
        return self._write(view.third_party[camera])

    def _write(self, frame: NDArray[np.uint8]) -> FrameRef:
        path = self._folder / f"{self._n_frames:09d}.png"
        self._n_frames += 1
        with wrap_errors(f"{path}: cannot be written", writing_hint(", or set TMPDIR")):
            write_png(path, frame, level=1)  # temporary: speed matters more than size
        return FrameRef(path)
