"""Questions on frames as training sequences, of a home as it was recorded or told otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.prompts import question_text
from infthor_eval.training.encoding import Encoder, TrainingSequence
from model_adapters.hf.prompting.prompt import Frame, Piece
from recipes.nano.reading.branches import BranchedSequence, with_branches
from recipes.nano.reading.frame_units import ChangedFrame
from recipes.nano.reading.homes import Home
from recipes.nano.reading.network import FrameEvents

_N_TAILS = 50_000  # encoded questions that are kept


@dataclass(frozen=True)
class ReadingSequence:
    """Questions on some frames, as branches of one sequence.

    Attributes:
        tokens: the sequence.
        events: what happened before each of its frames.
    """

    tokens: BranchedSequence
    events: FrameEvents


def question_intro() -> str:
    """Return the text that precedes every question, on clue frames as behind a memory."""
    return _prompt("").rstrip()


def _prompt(text: str) -> str:
    return question_text(CONTEXTS["clues"].intro, Question("", text, (), ()))


class Asker:
    """Encodes questions and answers, each of them once for all frames.

    Args:
        encoder: builds sequences.
        any_frame: a frame; what follows the last one does not depend on it.
    """

    def __init__(self, encoder: Encoder, any_frame: FrameRef) -> None:
        self._encoder = encoder
        self._any_frame = any_frame
        self._tail = lru_cache(_N_TAILS)(self._encode_tail)

    def ask(
        self,
        frames: Sequence[FrameRef],
        home: Home,
        asked: Sequence[tuple[str, str]],
        events: FrameEvents,
    ) -> ReadingSequence:
        """Return questions on frames.

        Args:
            frames: the frames, in order.
            home: the home that they show.
            asked: texts and answers, at least one.
            events: what happened before each of the frames.
        """
        head = self._encoder.pieces([*frames, ""])
        head = head[: _n_with_frames(head)]
        head = [_in_home(one, home) if isinstance(one, Frame) else one for one in head]
        shown = TrainingSequence("frames", tuple(head), (False,) * len(head))
        tails = [self._tail(text, answer) for text, answer in asked]
        return ReadingSequence(with_branches("questions", shown, tails), events)

    def _encode_tail(self, text: str, answer: str) -> TrainingSequence:
        """Return what follows the last frame."""
        whole = self._encoder.answer("question", [self._any_frame, _prompt(text)], answer)
        n = _n_with_frames(whole.pieces)
        return TrainingSequence(whole.name, whole.pieces[n:], whole.has_loss[n:])


def _in_home(frame: Frame, home: Home) -> Frame:
    if home.order is None and not home.turned:
        return frame
    units = home.turned_units
    return ChangedFrame(frame.digest, frame.size, frame.ids, frame.ref, home.order, units)


def _n_with_frames(pieces: Sequence[Piece]) -> int:
    """Return the number of pieces up to the last frame."""
    return max(at for at, piece in enumerate(pieces) if isinstance(piece, Frame)) + 1
