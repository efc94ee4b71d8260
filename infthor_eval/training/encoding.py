"""Training sequences: token ids and frames, and which of them have loss.

They are encoded by the prompter of evaluation from the same texts, so training and evaluation have
the same prompts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.household.sequence_text import ACT, action_part, plan_part
from infthor_eval.plans.history.segments import PlanSegment, segment_parts
from model_adapters import Part, Turn
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Frame, Piece, Prompter, n_common, n_tokens

__all__ = [
    "Encoder",
    "SkippedSequence",
    "TrainingSequence",
    "join_branches",
    "with_branches",
    "within",
]


@dataclass(frozen=True)
class TrainingSequence:
    """One training sequence.

    Attributes:
        name: source of the sequence ("traj_a, plans 3 to 9"), for messages.
        pieces: token ids and frames.
        has_loss: for each piece, true if loss is computed on it; always false for frames.
        branches: numbers of pieces of its branches, if the sequence ends in several: each of them
            follows what is before the first one, and sees none of the others.
    """

    name: str
    pieces: tuple[Piece, ...]
    has_loss: tuple[bool, ...]
    branches: tuple[int, ...] = ()

    def part(self, places: slice) -> "TrainingSequence":
        """Return some pieces of a sequence without branches."""
        return TrainingSequence(self.name, self.pieces[places], self.has_loss[places])

    @property
    def spans(self) -> list[slice]:
        """Places of the pieces before all branches, and of each branch."""
        ends = list(accumulate(self.branches, initial=len(self.pieces) - sum(self.branches)))
        return [slice(start, end) for start, end in pairwise([0, *ends])]

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


def join_branches(name: str, sequences: Sequence[TrainingSequence]) -> TrainingSequence:
    """Return sequences that begin alike as one, which has the beginning once.

    Its loss is the sum of theirs, at the price of one context: a trajectory takes most of the
    tokens of each question on it.

    Args:
        name: source of the sequence.
        sequences: sequences without branches; the first piece of each has no loss.
    """
    # The piece before the first with loss is part of the branch: the loss is computed there.
    firsts = [sequence.has_loss.index(True) - 1 for sequence in sequences]
    n = min(n_common([sequence.pieces for sequence in sequences]), *firsts)
    return with_branches(
        name, sequences[0].part(slice(n)), [one.part(slice(n, None)) for one in sequences]
    )


def with_branches(
    name: str, head: TrainingSequence, tails: Sequence[TrainingSequence]
) -> TrainingSequence:
    """Return a sequence that goes on in several ways, given what is before them and each of them.

    Args:
        name: source of the sequence.
        head: what all of them follow; without branches, as the others are.
        tails: the branches.
    """
    return TrainingSequence(
        name,
        (*head.pieces, *(piece for tail in tails for piece in tail.pieces)),
        (*head.has_loss, *(flag for tail in tails for flag in tail.has_loss)),
        tuple(len(tail.pieces) for tail in tails),
    )


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
        """Return the prompt of a user turn with these parts, after a system's turn if there is one.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the template refuses the parts.
        """
        told = () if system is None else (Turn("system", (system,)),)
        return self._prompter.pieces([*told, Turn("user", tuple(parts))])

    def actions(self, name: str, segments: Sequence[PlanSegment]) -> TrainingSequence:
        """Encode a history, with loss on its actions and the marks around them (appendix B).

        Raises:
            DataError: a frame cannot be read, or a text of the history contains a mark.
            ModelError: the template refuses the history.
        """
        return self._encode_actions(
            name, segment_parts(segments), sum(len(segment.steps) for segment in segments)
        )

    def chat_actions(self, name: str, system: str, parts: Sequence[Part]) -> TrainingSequence:
        """Encode a user's turn of goals, actions and frames after a system prompt, with loss as in
        a history.

        Raises:
            DataError: a frame cannot be read, or a text but the actions contains a mark.
            ModelError: the template refuses the turns.
        """
        n_actions = sum(isinstance(part, str) and part.startswith(ACT) for part in parts)
        return self._with_loss(name, self.pieces(parts, system), n_actions)

    def frame_tokens(self, frame: FrameRef) -> int:
        """Return the tokens of a frame, without those that the template writes around it.

        Raises:
            DataError: the frame cannot be read.
        """
        return len(self._prompter.frame(frame).ids)

    def text_plan(self, name: str, plan: str, actions: Sequence[str]) -> TrainingSequence:
        """Encode a plan and its actions without frames, with loss as in a history.

        Raises:
            DataError: a text contains a mark.
            ModelError: the template refuses the texts.
        """
        return self._encode_actions(
            name, [plan_part(plan), *map(action_part, actions)], len(actions)
        )

    def _encode_actions(self, name: str, parts: Sequence[Part], n_actions: int) -> TrainingSequence:
        return self._with_loss(name, self.pieces(parts), n_actions)

    def _with_loss(self, name: str, pieces: Sequence[Piece], n_actions: int) -> TrainingSequence:
        if pieces.count(self._mark) != 2 * n_actions:
            raise DataError(
                f"{name}: a goal, a plan or an action contains {ACT}; leave the trajectory out"
            )
        return TrainingSequence(name, tuple(pieces), tuple(self._is_between_marks(pieces)))

    def answer(
        self, name: str, parts: Sequence[Part], answer: str, system: str | None = None
    ) -> TrainingSequence:
        """Encode question and answer, with loss on the answer and the token that ends the turn.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the template refuses the question.
        """
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
