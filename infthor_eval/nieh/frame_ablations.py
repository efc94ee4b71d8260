"""Frame ablations: other frames instead of the true ones, to measure what seeing them gains.

To add a frame ablation: its effect here, its name in `options.py: FRAMES`.
"""

import random
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import UsageError
from infthor_eval.formats.blank import blank_like
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.video import Video
from infthor_eval.nieh.contexts import Context, ContextPart, Sample
from infthor_eval.nieh.options import SHOWN, check_frames

__all__ = ["FrameAblation"]


@dataclass(frozen=True)
class FrameAblation:
    """An ablation of the frames of requests; their text stays as it is.

    Attributes:
        frames: "shown" (the true frames), "blank" (grey frames of the same size), "shuffled" (the
            true frames in another order) or "other" (frames at the same positions of another
            trajectory of the set).
        seed: seed of the order and of the choice of the other trajectory.
    """

    frames: str = SHOWN
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise UsageError if there is no such ablation."""
        check_frames(self.frames)

    def check(self, data: NiehSet) -> None:
        """Check that a set allows the ablation.

        Raises:
            UsageError: the set has no other trajectory.
        """
        if self.frames == "other" and len(_trajectories(data)) < 2:
            raise UsageError(
                f"--frames other: {data.root} has questions on one trajectory only; give another "
                "set"
            )

    def apply(
        self, parts: Sequence[ContextPart], data: NiehSet, context: Context, sample: Sample
    ) -> list[ContextPart]:
        """Return the parts of a request with the frames replaced."""
        if self.frames == SHOWN:
            return list(parts)
        frames = [frame for part in parts for frame in _frames_in(part)]
        if self.frames == "blank":
            replacements = [blank_like(frame) for frame in frames]
        elif self.frames == "shuffled":
            replacements = self._shuffle(frames, sample.question.traj_id)
        else:
            replacements = self._frames_elsewhere(frames, data, context, sample)
        left = iter(replacements)
        return [_with_frames(part, [next(left) for _ in _frames_in(part)]) for part in parts]

    def _shuffle(self, frames: Sequence[FrameRef], traj_id: str) -> list[FrameRef]:
        """Return frames in another order, if any; the same for all questions in a context."""
        draw = random.Random(f"{self.seed}/{traj_id}/{'/'.join(frame.name for frame in frames)}")
        shuffled = list(frames)
        while len(set(frames)) > 1 and shuffled == list(frames):
            draw.shuffle(shuffled)
        return shuffled

    def _frames_elsewhere(
        self, frames: Sequence[FrameRef], data: NiehSet, context: Context, sample: Sample
    ) -> list[FrameRef]:
        """Return another trajectory's frames at the same positions, modulo its length."""
        traj_id = sample.question.traj_id
        others = [other for other in _trajectories(data) if other != traj_id]
        other_frames = context.frames(
            data, random.Random(f"{self.seed}/{traj_id}").choice(others), sample.fps
        )
        positions = {
            frame: position
            for position, frame in enumerate(context.frames(data, traj_id, sample.fps))
        }
        return [other_frames[positions[frame] % len(other_frames)] for frame in frames]


def _trajectories(data: NiehSet) -> list[str]:
    return sorted({question.traj_id for question in data.questions})


def _frames_in(part: ContextPart) -> tuple[FrameRef, ...]:
    if isinstance(part, Video):
        return part.frames
    return (part,) if isinstance(part, FrameRef) else ()


def _with_frames(part: ContextPart, frames: Sequence[FrameRef]) -> ContextPart:
    if isinstance(part, Video):
        return Video(tuple(frames), part.fps)
    return frames[0] if frames else part
