"""What is shown in the places of frames: they themselves or, to tell what a model owes to seeing them, stand-ins."""

import random
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import UsageError
from infthor_eval.formats.blank import blank_like
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import Context, ContextPart
from infthor_eval.nieh.notes import Notes
from infthor_eval.nieh.options import SHOWN, check_frames

__all__ = ["StandIns"]


@dataclass(frozen=True)
class StandIns:
    """What is shown in the places of a request's frames; its text stays as it is.

    Attributes:
        frames: "shown" (they themselves), "blank" (grey, of the same size), "shuffled" (they themselves in another
            order) or "other" (those at the same places of another trajectory of the set).
        seed: for the order and for which trajectory.
    """

    frames: str = SHOWN
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what is not known.

        Raises:
            UsageError: there are no such stand-ins.
        """
        check_frames(self.frames)

    def check(self, data: NiehSet) -> None:
        """Refuse a set that has none.

        Raises:
            UsageError: there is no other trajectory.
        """
        if self.frames == "other" and len(_trajectories(data)) < 2:
            raise UsageError(f"--frames other: {data.root} has questions on one trajectory alone; take another set")

    def put(self, parts: Sequence[ContextPart], data: NiehSet, context: Context, traj_id: str) -> list[ContextPart]:
        """The parts of a request with what is shown in the places of frames.

        Args:
            parts: what a model is shown.
            data: the set.
            context: the context that the parts are of.
            traj_id: the trajectory that the frames are of.
        """
        if self.frames == SHOWN:
            return list(parts)
        frames = [frame for part in parts for frame in _frames_in(part)]
        if self.frames == "blank":
            shown = [blank_like(frame) for frame in frames]
        elif self.frames == "shuffled":
            shown = self._shuffled(frames, traj_id)
        else:
            shown = self._of_another(frames, data, context, traj_id)
        left = iter(shown)
        return [_with_frames(part, [next(left) for _ in _frames_in(part)]) for part in parts]

    def _shuffled(self, frames: Sequence[FrameRef], traj_id: str) -> list[FrameRef]:
        """In an order that is another one wherever there is one; the same for every question in one context."""
        draw = random.Random(f"{self.seed}/{traj_id}/{'/'.join(frame.path.name for frame in frames)}")
        shuffled = list(frames)
        while len(set(frames)) > 1 and shuffled == list(frames):
            draw.shuffle(shuffled)
        return shuffled

    def _of_another(self, frames: Sequence[FrameRef], data: NiehSet, context: Context, traj_id: str) -> list[FrameRef]:
        """From the same places; where the other trajectory is shorter, counted on from its start."""
        others = [other for other in _trajectories(data) if other != traj_id]
        shown = context.frames(data, random.Random(f"{self.seed}/{traj_id}").choice(others))
        places = {frame: place for place, frame in enumerate(context.frames(data, traj_id))}
        return [shown[places[frame] % len(shown)] for frame in frames]


def _trajectories(data: NiehSet) -> list[str]:
    return sorted({question.traj_id for question in data.questions})


def _frames_in(part: ContextPart) -> tuple[FrameRef, ...]:
    if isinstance(part, Notes):
        return part.frames
    return (part,) if isinstance(part, FrameRef) else ()


def _with_frames(part: ContextPart, frames: Sequence[FrameRef]) -> ContextPart:
    if isinstance(part, Notes):
        return Notes(part.traj_id, tuple(frames), part.taking)
    return frames[0] if frames else part
