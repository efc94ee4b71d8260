"""Sequences as a model is trained on them: token ids and frames, each with whether loss is taken on it.

The ids are made by what makes a model's prompts, from the same texts: what is trained is what is asked for later.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from infthor_eval.errors import DataError
from infthor_eval.household.sequence_text import ACT, action_part, plan_part
from infthor_eval.plans.segments import PlanSegment, segment_parts
from model_adapters import Part, Turn
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.prompt import Frame, Piece, Prompter, n_tokens

__all__ = ["Encoder", "SkippedItem", "TrainingSequence"]


@dataclass(frozen=True)
class TrainingSequence:
    """One sequence.

    Attributes:
        name: where it comes from ("traj_a, plans 3 to 9"), for messages.
        pieces: ids, and frames with theirs.
        trained: for each piece, whether loss is taken on it; never on a frame.
    """

    name: str
    pieces: tuple[Piece, ...]
    trained: tuple[bool, ...]

    @property
    def n_tokens(self) -> int:
        """Its length, frames expanded."""
        return n_tokens(self.pieces)

    @property
    def n_trained(self) -> int:
        """How many tokens loss is taken on."""
        return sum(self.trained)

    @property
    def frames(self) -> list[Frame]:
        """Its frames, in order."""
        return [piece for piece in self.pieces if isinstance(piece, Frame)]


@dataclass(frozen=True)
class SkippedItem:
    """Something that no sequence could be made of.

    Attributes:
        name: what.
        reason: why.
    """

    name: str
    reason: str


class Encoder:
    """Makes sequences for one checkpoint.

    Args:
        loaded: the checkpoint; its template writes what its prompts are written by.
    """

    def __init__(self, loaded: Loaded) -> None:
        self._tokenizer: Any = loaded.tokenizer
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
        self._mark: int = loaded.tokenizer.convert_tokens_to_ids(ACT)
        ends = loaded.generation.end_ids
        self._end: int = loaded.tokenizer.eos_token_id if loaded.tokenizer.eos_token_id in ends else min(ends)

    def pieces(self, parts: Sequence[Part]) -> list[Piece]:
        """What a model is fed of a user's turn of these parts.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the template refuses them.
        """
        return self._prompter.pieces([Turn("user", tuple(parts))])

    def actions(self, name: str, segments: Sequence[PlanSegment]) -> TrainingSequence:
        """A history; loss is taken on its actions and the marks around them (appendix B).

        Raises:
            DataError: a frame cannot be read, or a text of the history holds a mark.
            ModelError: the template refuses them.
        """
        return self._acted(name, segment_parts(segments), sum(len(segment.steps) for segment in segments))

    def order(self, name: str, plan: str, actions: Sequence[str]) -> TrainingSequence:
        """A plan and its actions without a frame; loss is taken as on a history.

        Raises:
            DataError: a text holds a mark.
            ModelError: the template refuses them.
        """
        return self._acted(name, [plan_part(plan), *map(action_part, actions)], len(actions))

    def _acted(self, name: str, parts: Sequence[Part], n_actions: int) -> TrainingSequence:
        pieces = self.pieces(parts)
        if pieces.count(self._mark) != 2 * n_actions:
            raise DataError(f"{name}: a goal, a plan or an action holds {ACT}; leave the trajectory out")
        return TrainingSequence(name, tuple(pieces), tuple(self._between_marks(pieces)))

    def answer(self, name: str, parts: Sequence[Part], answer: str) -> TrainingSequence:
        """A question and its answer; loss is taken on the answer and the token that ends the turn.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the template refuses them.
        """
        asked = self.pieces(parts)
        reply: list[int] = [*self._tokenizer(answer, add_special_tokens=False)["input_ids"], self._end]
        return TrainingSequence(name, (*asked, *reply), (False,) * len(asked) + (True,) * len(reply))

    def _between_marks(self, pieces: Sequence[Piece]) -> Iterator[bool]:
        within = False
        for piece in pieces:
            if piece == self._mark:
                within = not within
                yield True
            else:
                yield within
