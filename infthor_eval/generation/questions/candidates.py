"""What question rules make, before some of it is chosen."""

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.formats.question import Answer, Question
from infthor_eval.household.affordances import preposition
from infthor_eval.household.wording import canonical_type, compact_name, noun

__all__ = [
    "MANY",
    "Candidate",
    "answer_of",
    "are_distinguishable",
    "further_type",
    "in_or_on",
    "listing_question",
    "with_the",
]

MANY = 6  # gold answers; longer lists are a test of writing, not of seeing
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
        question_type: its type.
        form: the question with "{}" where it names things; balance is kept within a form.
        names: what stands there.
        clues: the frames that show the answer, in order.
        answers: the gold answers.
        subjects: object types that it is about, for balance.
        absence: whether the answer is that something is not there, which no frame proves.
    """

    question_type: str
    form: str
    names: tuple[str, ...]
    clues: tuple[int, ...]
    answers: tuple[Answer, ...]
    subjects: tuple[str, ...]
    absence: bool = False

    @property
    def text(self) -> str:
        """The question."""
        return self.form.format(*self.names)

    @property
    def is_closed(self) -> bool:
        """Whether the answer is yes, no or a number: few answers, which must not be guessed from the form."""
        answer = str(self.answers[0])
        return len(self.answers) == 1 and (answer in {"yes", "no"} or answer.isdecimal())

    def question(self, traj_id: str) -> Question:
        """The question as sets hold it."""
        return Question(traj_id, self.text, self.clues, self.answers, self.question_type, self.absence)


def further_type(question_type: str) -> str:
    """The question type of our own forms beside those of Table 3's type."""
    return f"{question_type}_further"


def with_the(object_type: str) -> str:
    """ "the coffee table" for an object type."""
    return f"the {noun(canonical_type(object_type))}"


def in_or_on(object_type: str) -> str:
    """ "on the coffee table", "in the fridge" for a receptacle type."""
    return f"{preposition(object_type)} {with_the(object_type)}"


def answer_of(object_type: str) -> str:
    """An object type as a gold answer, in the published data's form ("coffeetable")."""
    return compact_name(canonical_type(object_type))


def are_distinguishable(object_types: Sequence[str]) -> bool:
    """Whether a list of these types can be a gold answer: no scorer may take one for another.

    The published scorer deletes "and" inside words of lists too ("candle"), so such words cannot be in one.
    """
    words = [answer_of(object_type) for object_type in object_types]
    if len(words) > 1 and any("and" in word for word in words):
        return False
    for index, word in enumerate(words):
        for other, object_type in zip(words[:index], object_types[:index], strict=True):
            if difflib.SequenceMatcher(None, word, other).ratio() >= _SIMILAR:
                return False
            if any({canonical_type(object_type), canonical_type(object_types[index])} <= group for group in _ALIKE):
                return False
    return True


def listing_question(
    question_type: str, form: str, occasions: Iterable[tuple[str | None, int | None]]
) -> Iterator[Candidate]:
    """A question on all types that something happened with, each with the first frame that shows it happen.

    Args:
        question_type: the question's type.
        form: the question; it names nothing.
        occasions: of each, the object type (None where that is not clear) and the frame (None where none shows it).

    Yields:
        The question, if every type is shown and the types can be a gold answer.
    """
    everything = list(occasions)
    first: dict[str, int] = {}
    for name, frame in everything:
        if name is not None and frame is not None:
            first.setdefault(canonical_type(name), frame)
    complete = all(name is not None and canonical_type(name) in first for name, _ in everything)
    if first and complete and len(first) <= MANY and are_distinguishable(list(first)):
        answers = tuple(answer_of(name) for name in first)
        yield Candidate(question_type, form, (), tuple(first.values()), answers, tuple(first))
