"""Candidate questions, which the rules generate and from which a set is sampled."""

import difflib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from infthor_eval.formats.question import Answer, Question
from infthor_eval.household.wording import answer_of, canonical_type

MANY = 6  # maximum number of gold answers; longer lists would test writing, not seeing
_SIMILAR = 0.75  # the published scorer accepts answers from a similarity of 0.8 on
_ALIKE = (  # types that people call by each other's names
    {"Pen", "Pencil"},
    {"Desk", "SideTable", "CoffeeTable", "DiningTable", "CounterTop"},
    {"Dresser", "Drawer"},
    {"Sofa", "ArmChair", "Bed", "Chair"},
    {"CreditCard", "CellPhone"},
)


@dataclass(frozen=True)
class Candidate:
    """A valid question.

    Attributes:
        question_type: type of the question.
        form: the question with "{}" for the names in it; answers are balanced within a form.
        names: names to insert into the form.
        clues: frames that show the answer, in order.
        answers: gold answers.
        subjects: object types in question and answer, for balancing.
        absence: True if the answer is that something is nowhere, for which no frame is evidence.
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
        """Text of the question."""
        return self.form.format(*self.names)

    @property
    def is_closed(self) -> bool:
        """True if the answer is yes, no or a number: a form's answers must then be balanced."""
        answer = str(self.answers[0])
        return len(self.answers) == 1 and (answer in {"yes", "no"} or answer.isdecimal())

    def question(self, traj_id: str) -> Question:
        """Return the question in the form of sets."""
        return Question(
            traj_id, self.text, self.clues, self.answers, self.question_type, self.absence
        )


def further_type(question_type: str) -> str:
    """Return the question type of our forms that belongs to a type of Table 3."""
    return f"{question_type}_further"


def are_distinguishable(object_types: Sequence[str]) -> bool:
    """Return True if no scorer confuses two of these types as gold answers of one question."""
    words = [answer_of(object_type) for object_type in object_types]
    # The published scorer deletes "and" from lists even inside of words ("candle").
    if len(words) > 1 and any("and" in word for word in words):
        return False
    for index, word in enumerate(words):
        for other, object_type in zip(words[:index], object_types[:index], strict=True):
            if difflib.SequenceMatcher(None, word, other).ratio() >= _SIMILAR:
                return False
            if any(
                {canonical_type(object_type), canonical_type(object_types[index])} <= group
                for group in _ALIKE
            ):
                return False
    return True


def type_question(
    question_type: str,
    form: str,
    names: tuple[str, ...],
    clues: tuple[int, ...],
    types: Sequence[str],
    subjects: tuple[str, ...] = (),
) -> Iterator[Candidate]:
    """Yield a question with object types as answers, unless none, too many, or two alike."""
    if 0 < len(types) <= MANY and are_distinguishable(types):
        answers = tuple(map(answer_of, types))
        yield Candidate(question_type, form, names, clues, answers, (*subjects, *types))


def listing_question(
    question_type: str, form: str, events: Iterable[tuple[str, tuple[int, ...] | None]]
) -> Iterator[Candidate]:
    """Yield a question on all types of some events, with the frames of the first shown of each.

    Args:
        question_type: type of the question.
        form: the question, without names in it.
        events: object type and frames (None if none show it) of each event. If no event of a type
            is shown, there is no question.
    """
    types: set[str] = set()
    first: dict[str, tuple[int, ...]] = {}
    for name, frames in events:
        types.add(canonical_type(name))
        if frames is not None:
            first.setdefault(canonical_type(name), frames)
    if len(first) == len(types):
        clues = tuple(sorted({frame for frames in first.values() for frame in frames}))
        yield from type_question(question_type, form, (), clues, list(first))
