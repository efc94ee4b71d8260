"""Training sequences: token ids and frames, and which of them have loss.

They are encoded by the prompter of evaluation from the same texts, so training and evaluation have
the same prompts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT
from model_adapters import Part, Turn
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Frame, Piece, Prompter, n_tokens


@dataclass(frozen=True)
class TrainingSequence:
    """One training sequence.

    Attributes:
        name: source of the sequence ("traj_a, plans 3 to 9"), for messages.
        pieces: token ids and frames.
        has_loss: for each piece, true if loss is computed on it; always false for frames.
    """

    name: str
    pieces: tuple[Piece, ...]
    has_loss: tuple[bool, ...]

    @property
    def n_tokens(self) -> int:
        """Tokens of the sequence, frames expanded."""
        return n_tokens(self.pieces)

    @property
    def n_loss_tokens(self) -> int:
        """Tokens with loss."""
        return sum(self.has_loss)

    @property
    def frames(self) -> list[Frame]:
        """Frames in order."""
        return [piece for piece in self.pieces if isinstance(piece, Frame)]


@dataclass(frozen=True)
class SkippedSequence:
    """A part of the data that could not become a sequence.

    Attributes:
        name: name of the trajectory, plan or question.
        reason: reason, for people.
    """

    name: str
    reason: str


def within(sequence: TrainingSequence, limit: int) -> TrainingSequence | SkippedSequence:
    """Return the sequence, or a skipped item if it has more tokens than the limit, all expanded."""
    return (
        SkippedSequence(sequence.name, f"longer than {limit} tokens")
        if sequence.n_tokens > limit
        else sequence
    )


class Encoder:
    """Builds sequences for one checkpoint; its template also renders prompts in evaluation."""

    def __init__(self, loaded: LoadedCheckpoint) -> None:
        self._tokenizer: Any = loaded.tokenizer
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
        self._mark: int = loaded.tokenizer.convert_tokens_to_ids(ACT)
        ends = loaded.generation.end_ids
        self._end: int = (
            loaded.tokenizer.eos_token_id if loaded.tokenizer.eos_token_id in ends else min(ends)
        )

    def pieces(self, parts: Sequence[Part], system: str | None = None) -> list[Piece]:
        """Return the prompt of a user turn with these parts, after a system's turn if there is
        one."""
        told = () if system is None else (Turn("system", (system,)),)
        return self._prompter.pieces([*told, Turn("user", tuple(parts))])

    def actions(
        self, name: str, parts: Sequence[Part], system: str | None = None
    ) -> TrainingSequence:
        """Encode a user's turn of goals, plans, actions and frames, after a system's turn if there
        is one, with loss on the actions and the marks around them (appendix B).
        """
        pieces = self.pieces(parts, system)
        n_actions = sum(isinstance(part, str) and part.startswith(ACT) for part in parts)
        if pieces.count(self._mark) != 2 * n_actions:
            raise DataError(
                f"{name}: a goal, a plan or an action contains {ACT}; leave the trajectory out"
            )
        return TrainingSequence(name, tuple(pieces), tuple(self._is_between_marks(pieces)))

    def frame_tokens(self, frame: FrameRef) -> int:
        """Return the tokens of a frame, without those that the template writes around it."""
        return len(self._prompter.frame(frame).ids)

    def answer(
        self, name: str, parts: Sequence[Part], answer: str, system: str | None = None
    ) -> TrainingSequence:
        """Encode question and answer, with loss on the answer and the token that ends the turn."""
        prompt = self.pieces(parts, system)
        reply: list[int] = [
            *self._tokenizer(answer, add_special_tokens=False)["input_ids"],
            self._end,
        ]
        return TrainingSequence(
            name, (*prompt, *reply), (False,) * len(prompt) + (True,) * len(reply)
        )

    def _is_between_marks(self, pieces: Sequence[Piece]) -> Iterator[bool]:
        within = False
        for piece in pieces:
            if piece == self._mark:
                within = not within
                yield True
            else:
                yield within
