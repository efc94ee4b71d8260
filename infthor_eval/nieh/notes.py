"""Notes that a model takes while it reads a trajectory, to be shown instead of the frames.

What a model writes is known only once it has written it. So a context holds `Notes` in the place of the text; the notes
are written window by window when the model runs, and their text is put there (`infthor_eval.nieh.notebook`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.prompts import note_text

__all__ = ["NoteSettings", "Notes", "Window"]


@dataclass(frozen=True)
class NoteSettings:
    """Settings of note taking: the frames of a window, for one note, and the limit of the note in tokens."""

    window: int
    max_new_tokens: int


@dataclass(frozen=True)
class Window:
    """Consecutive frames of one note, at least one; `first` is the position of the first in the trajectory."""

    first: int
    frames: tuple[FrameRef, ...]

    @property
    def steps(self) -> str:
        """The steps in words: "Steps 0-19"."""
        last = self.first + len(self.frames) - 1
        return f"Step {last}" if last == self.first else f"Steps {self.first}-{last}"

    @property
    def request(self) -> tuple[FrameRef | str, ...]:
        """The request for the note: frames and text."""
        return (*self.frames, note_text(self.steps))


@dataclass(frozen=True)
class Notes:
    """A model's notes on all frames of a trajectory, in time order."""

    traj_id: str
    frames: tuple[FrameRef, ...]
    settings: NoteSettings

    @cached_property
    def windows(self) -> tuple[Window, ...]:
        """The windows, one for each note."""
        size = self.settings.window
        return tuple(Window(at, self.frames[at : at + size]) for at in range(0, len(self.frames), size))

    def text(self, notes: Sequence[str]) -> str:
        """Return the text that is shown: a line for each window, given the notes on them."""
        pairs = zip(self.windows, notes, strict=True)
        return "".join(f"{window.steps}: {' '.join(note.split())}\n" for window, note in pairs)
