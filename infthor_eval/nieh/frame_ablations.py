"""Frame ablations: other frames instead of the true ones, to measure what seeing them gains.

To add a frame ablation: its effect here, its name in `options.py: FRAMES`.
"""

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.blank import blank_like
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import VIEW_FOLLOWS, Context, ContextPart, QuestionVariant
from infthor_eval.nieh.options import BLANK, NO_CLUE, NONE, OTHER, SHOWN, check_frames
from infthor_eval.nieh.other_homes import count_homes, draw_other_home


@dataclass(frozen=True)
class FrameAblation:
    """An ablation of the frames of requests; their text stays as it is.

    Attributes:
        frames: "shown" (the true frames), "blank" (grey frames of the same size), "shuffled" (the
            true frames in another order), "other" (frames at the same positions of another home of
            the same kind of room), "no-clue" (without the frames with the evidence, of twins of
            both worlds) or "none" (texts alone, as models without vision read).
        seed: seed of the order and of the choice of the other home.
    """

    frames: str = SHOWN
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise UsageError if there is no such ablation."""
        check_frames(self.frames)

    def check(self, data: NiehSet) -> None:
        """Check that a set allows the ablation."""
        if self.frames == OTHER and count_homes(data) < 2:
            raise UsageError(
                f"--frames other: {data.root} has questions on one trajectory only; give another "
                "set"
            )

    def apply(
        self, parts: Sequence[ContextPart], data: NiehSet, context: Context, sample: QuestionVariant
    ) -> list[ContextPart]:
        """Return the parts of a request with the frames replaced, or without the clue frames."""
        frames = [frame for part in parts for frame in _frames_in(part)]
        if self.frames == SHOWN or not frames:
            return list(parts)
        # A memory that has not recalled yet shows the last of its frames alone.
        places = sample.frames[-len(frames) :]
        if self.frames == NONE:
            return [part.removesuffix(VIEW_FOLLOWS) for part in parts if isinstance(part, str)]
        if self.frames == BLANK:
            replaced: Sequence[FrameRef | None] = [blank_like(frame) for frame in frames]
        elif self.frames == "shuffled":
            replaced = self._shuffle(frames, places, sample.question)
        elif self.frames == NO_CLUE:
            positions = self._positions(data, context, sample)[-len(frames) :]
            replaced = self._without_clues(frames, positions, data, sample)
        else:
            replaced = self._frames_elsewhere(places, data, context, sample)
        left = iter(replaced)
        return [kept for part in parts for kept in _with_frames(part, left)]

    def hidden(self, data: NiehSet, question: Question) -> frozenset[int]:
        """Return the positions in the trajectory of the frames that are not shown: the clues.

        There are none without this ablation, and for an absence, of which no frame is evidence.
        """
        if self.frames != NO_CLUE or not question.has_evidence or not data.has_frames:
            return frozenset()
        return frozenset(data.clue_positions(question))

    def positions(self, data: NiehSet, context: Context, sample: QuestionVariant) -> list[int]:
        """Return where in the trajectory's time order the frames of a request are.

        Those that stand for others have the positions of these.
        """
        if self.frames == NONE:
            return []
        positions = self._positions(data, context, sample)
        hidden = self.hidden(data, sample.question)
        if _keeps_places(sample) or hidden.issuperset(positions):
            return positions
        return [position for position in positions if position not in hidden]

    def true_positions(self, data: NiehSet, context: Context, sample: QuestionVariant) -> list[int]:
        """Return the same, of those frames alone that are what the trajectory has there."""
        if self.frames in (BLANK, OTHER):
            return []
        hidden = self.hidden(data, sample.question)
        positions = self.positions(data, context, sample)
        return [position for position in positions if position not in hidden]

    def _positions(self, data: NiehSet, context: Context, sample: QuestionVariant) -> list[int]:
        """Return where in the trajectory the frames of a sample are, before any is taken out."""
        positions = list(context.positions(data, sample))
        if self.frames == NO_CLUE and len(positions) != len(sample.frames):
            raise DataError(
                f"the film of {sample.question.traj_id} shows {len(sample.frames)} frames where "
                f"its trajectory has {len(positions)}, so it is not known which are clues; leave "
                "out --frames no-clue"
            )
        return positions

    def _without_clues(
        self,
        frames: Sequence[FrameRef],
        positions: Sequence[int],
        data: NiehSet,
        sample: QuestionVariant,
    ) -> list[FrameRef | None]:
        """Return frames without the clues: None, or blank where positions or any frame must be
        kept."""
        hidden = self.hidden(data, sample.question)
        blanks = _keeps_places(sample) or hidden.issuperset(positions)
        return [
            frame if position not in hidden else blank_like(frame) if blanks else None
            for frame, position in zip(frames, positions, strict=True)
        ]

    def _shuffle(
        self, frames: Sequence[FrameRef], places: Sequence[int], question: Question
    ) -> list[FrameRef]:
        """Return frames in another order, if any; the same for all questions in a context.

        It depends on where they are, not on their pictures, so it is the same in both worlds of
        twins.
        """
        draw = random.Random(f"{self.seed}/{question.cluster}/{'/'.join(map(str, places))}")
        order = list(range(len(places)))
        while len(set(places)) > 1 and [places[at] for at in order] == list(places):
            draw.shuffle(order)
        return [frames[at] for at in order]

    def _frames_elsewhere(
        self, places: Sequence[int], data: NiehSet, context: Context, sample: QuestionVariant
    ) -> list[FrameRef]:
        """Return another home's frames at the same positions, modulo its length."""
        other = draw_other_home(data, sample.question, self.seed)
        frames = context.frames(data, other, sample.fps)
        return [frames[place % len(frames)] for place in places]


def _keeps_places(sample: QuestionVariant) -> bool:
    """Return True where a memory recalls by position: no frame can be taken out."""
    return sample.recall is not None or sample.recalled is not None


def _frames_in(part: ContextPart) -> tuple[FrameRef, ...]:
    if isinstance(part, Video):
        return part.frames
    return (part,) if isinstance(part, FrameRef) else ()


def _with_frames(part: ContextPart, left: Iterator[FrameRef | None]) -> list[ContextPart]:
    """Return a part with the next of the frames that are left; none if its own is taken out."""
    if isinstance(part, str):
        return [part]
    frames = [frame for _ in _frames_in(part) if (frame := next(left)) is not None]
    return [Video(tuple(frames), part.fps)] if isinstance(part, Video) else list(frames)
