"""A second opinion on questions: it reads the text and answers from the log, by another way than the rules.

It sees a list of glimpses (`solvers`). Given the whole log, every glimpse holds the true state of all objects; given
clue frames only, each holds what that frame's entry tells: the action that led to it and the objects large enough to be
seen. A question is sound if both give its gold answer, and its clues are minimal if no smaller set of them does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import Step
from infthor_eval.generation.questions.solvers import FrameFacts, answer, frame_facts

__all__ = ["Checker", "Verdict"]


@dataclass(frozen=True)
class Verdict:
    """Whether the whole log, the clues alone, and no smaller set of clues give the gold answer."""

    right: bool
    sufficient: bool
    minimal: bool

    @property
    def sound(self) -> bool:
        """Whether all three hold."""
        return self.right and self.sufficient and self.minimal


class Checker:
    """Judges the questions on one trajectory."""

    def __init__(self, steps: Sequence[Step], share: float) -> None:
        """Read the log.

        Args:
            steps: the log.
            share: of the frame's pixels that an object must fill to be seen.
        """
        self._whole = frame_facts(steps, share)
        self._single = {item.frame: item for item in frame_facts(steps, share, range(len(steps)))}

    def verdict(self, question: Question) -> Verdict:
        """Judge one question.

        An absence is proven by no frame; its clues count as minimal. Of a count that is mixed with frames without an
        occasion as many clues as it counts must be needed.
        """
        gold = sorted(str(item) for item in question.answers)
        clues = question.clues

        def gives(seen: Sequence[FrameFacts]) -> bool:
            found = answer(question.text, seen)
            return found is not None and sorted(found) == gold

        shown = [self._single[clue] for clue in clues]
        smaller = [[item for item in shown if item.frame != skipped] for skipped in clues]
        needed = sum(not gives(rest) for rest in smaller)
        if (question.question_type or "").endswith("_mixed"):
            minimal = [str(needed)] == gold and needed < len(clues)
        else:
            absence = question.text.startswith(("Is there any", "Have you seen")) and gold == ["no"]
            minimal = absence or needed == len(clues)
        return Verdict(gives(self._whole), gives(shown), minimal)
