"""What question rules make, before some of it is chosen."""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.formats.question import Answer, Question
from infthor_eval.generation.questions.history import canonical
from infthor_eval.generation.wording import compact, noun

__all__ = ["Candidate", "answer_of", "distinct", "the"]

_SIMILAR = 0.75  # the published scorer takes answers alike from 0.8 on
_ALIKE = (
    {"Pen", "Pencil"},
    {"Desk", "SideTable", "CoffeeTable", "DiningTable", "CounterTop"},
    {"Dresser", "Drawer"},
    {"Sofa", "ArmChair", "Bed", "Chair"},
    {"CreditCard", "CellPhone"},
)


@dataclass(frozen=True)
class Candidate:
    """A question that holds.

    Attributes:
        kind: its type.
        text: the question.
        clues: the frames that show the answer, in order.
        answers: the gold answers.
        subjects: object types that it is about, for balance.
    """

    kind: str
    text: str
    clues: tuple[int, ...]
    answers: tuple[Answer, ...]
    subjects: tuple[str, ...]

    def question(self, traj_id: str) -> Question:
        """The question as sets hold it."""
        return Question(traj_id, self.text, self.clues, self.answers, self.kind)


def the(kind: str) -> str:
    """ "the coffee table" for an object type."""
    return f"the {noun(canonical(kind))}"


def answer_of(kind: str) -> str:
    """An object type as a gold answer, in the published data's form ("coffeetable")."""
    return compact(canonical(kind))


def distinct(kinds: Sequence[str]) -> bool:
    """Whether a list of these types can be a gold answer: no scorer may take one for another.

    The published scorer deletes "and" inside words of lists too ("candle"), so such words cannot be in one.
    """
    words = [answer_of(kind) for kind in kinds]
    if len(words) > 1 and any("and" in word for word in words):
        return False
    for index, word in enumerate(words):
        for other, kind in zip(words[:index], kinds[:index], strict=True):
            if difflib.SequenceMatcher(None, word, other).ratio() >= _SIMILAR:
                return False
            if any({canonical(kind), canonical(kinds[index])} <= group for group in _ALIKE):
                return False
    return True
