"""Notes that a model takes while it reads a trajectory, to be shown instead of the frames.

What a model writes is known only once it has written it. So a context holds `Notes` where the text goes, and whoever
runs the model has the notes written, window by window, and puts their text there (`infthor_eval.runs.notebook`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.prompts import note_text

__all__ = ["Notes", "Notetaking", "Window"]


@dataclass(frozen=True)
class Notetaking:
    """How notes are taken.

    Attributes:
        window: frames read for one note.
        max_new_tokens: most tokens of one note.
    """

    window: int
    max_new_tokens: int


@dataclass(frozen=True)
class Window:
    """Consecutive frames that one note is about.

    Attributes:
        first: position of the first in the trajectory's time order.
        frames: at least one.
    """

    first: int
    frames: tuple[FrameRef, ...]

    @property
    def steps(self) -> str:
        """Which steps these are, for the model and for people: "Steps 0-19"."""
        last = self.first + len(self.frames) - 1
        return f"Step {last}" if last == self.first else f"Steps {self.first}-{last}"

    @property
    def request(self) -> tuple[FrameRef | str, ...]:
        """What the model is shown and told to write the note."""
        return (*self.frames, note_text(self.steps))


@dataclass(frozen=True)
class Notes:
    """A model's notes on a whole trajectory, in time order.

    Attributes:
        traj_id: the trajectory.
        frames: its frames in time order.
        taking: how the notes are taken.
    """

    traj_id: str
    frames: tuple[FrameRef, ...]
    taking: Notetaking

    @cached_property
    def windows(self) -> tuple[Window, ...]:
        """The frames in the pieces that one note each is about."""
        size = self.taking.window
        return tuple(Window(at, self.frames[at : at + size]) for at in range(0, len(self.frames), size))

    def text(self, notes: Sequence[str]) -> str:
        """What is shown: a line per window, given the note on each."""
        pairs = zip(self.windows, notes, strict=True)
        return "".join(f"{window.steps}: {' '.join(note.split())}\n" for window, note in pairs)
