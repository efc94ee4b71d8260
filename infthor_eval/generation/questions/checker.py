"""An independent check of questions, which answers their text in another way than the rules.

The answer is computed from the facts of frames (see `facts`). Facts of the whole log have the
true states of all objects, and the actions. Facts of clue frames have only what the pictures show:
the objects that are large enough to be seen, and no logged action. A question is sound if both give
its gold answer, and no smaller set of clues does.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import Step
from infthor_eval.generation.questions.facts import FrameFacts, facts_shown, frame_facts
from infthor_eval.generation.questions.solvers import answer

_SHOWN_BY_TWO_FRAMES = ("How many times did you open", "How many times did you put")


@dataclass(frozen=True)
class Verdict:
    """The result of a check.

    Attributes:
        right: True if the whole log gives the gold answer.
        sufficient: True if the clues give it.
        minimal: True if no smaller set of clues does.
    """

    right: bool
    sufficient: bool
    minimal: bool

    @property
    def sound(self) -> bool:
        """True if all three hold."""
        return self.right and self.sufficient and self.minimal


class Checker:
    """Checks the questions on one trajectory."""

    def __init__(self, steps: Sequence[Step], share: float) -> None:
        """Read the log; objects that fill this share of the frame's pixels count as seen."""
        self._whole = frame_facts(steps)
        shown = facts_shown(steps, self._whole, share)
        self._single = {frame.number: frame for frame in shown}

    def until(self, moment: int) -> "Checker":
        """Return the checker of the log up to a frame, which shares its facts."""
        part = copy(self)
        part._whole = self._whole[: moment + 1]
        return part

    def verdict(self, question: Question) -> Verdict:
        """Check one question.

        The clues of an absence question, for which no frame is evidence, count as minimal. For a
        further count, each event must have its own clues, and there must be others.
        """
        gold = sorted(map(str, question.answers))
        clues = question.clues

        def gives_gold(facts: Sequence[FrameFacts]) -> bool:
            answers = answer(question.text, facts)
            return answers is not None and sorted(answers) == gold

        shown = [self._single[clue] for clue in clues]
        n_necessary = 0
        for skipped in clues:
            n_necessary += not gives_gold([frame for frame in shown if frame.number != skipped])
        if question.question_type == "movement_counting_further":
            minimal = n_necessary < len(clues) and self._are_needed(question, n_necessary)
        else:
            absence = question.text.startswith(("Is there any", "Have you seen")) and gold == ["no"]
            minimal = absence or n_necessary == len(clues)
        return Verdict(gives_gold(self._whole), gives_gold(shown), minimal)

    def answers(self, text: str, clues: Sequence[int] | None = None) -> tuple[str, ...] | None:
        """Return the answers to a question's text by the whole log, or by what some frames show.

        It is None if they do not suffice.
        """
        facts = self._whole if clues is None else [self._single[clue] for clue in clues]
        found = answer(text, facts)
        return None if found is None else tuple(found)

    def _are_needed(self, question: Question, n_necessary: int) -> bool:
        """Return True if so many necessary clues fit a further count."""
        (count,) = map(int, question.answers)
        if question.text.startswith(_SHOWN_BY_TWO_FRAMES):
            return n_necessary == 2 * count
        return n_necessary <= count  # an object that was held may be seen in several clues
