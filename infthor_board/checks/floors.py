"""Whether a score is above what blindness and knowledge of homes give.

Both are warnings: who is no better than `blind` is not thereby dishonest. The row says it.
"""

from collections.abc import Iterator, Sequence
from typing import ClassVar

from infthor_board.case import Case
from infthor_board.expected import Expected
from infthor_board.reading import Problem
from infthor_eval.nieh.options import OTHER
from infthor_eval.nieh.results.above_blind import above_blind
from infthor_eval.statistics import paired_difference


class AboveBlind:
    """The score is above that of `blind`, which sees no frame."""

    name: ClassVar[str] = "above blind"
    reason: ClassVar[str] = "a score that is had without a frame shows no memory"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        for task in case.shown:
            if not self.is_above(task):
                yield Problem(
                    self.name,
                    f"{task.name}: is not above blind, which sees no frame",
                    is_warning=True,
                )

    @staticmethod
    def is_above(task: Expected) -> bool:
        """Return True if the whole interval of the score above blind is above 0."""
        of_task = above_blind(task.graded, "strict")
        return of_task.low is not None and of_task.low > 0


class AboveOtherHome:
    """The score is above that on another home of the same kind."""

    name: ClassVar[str] = "above other home"
    reason: ClassVar[str] = "knowledge of homes looks like memory of this one"

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """See `Check`."""
        controls = {task.name: task for task in case.controls(OTHER)}
        for task in case.shown:
            control = controls.get(task.name)
            if control is None:
                text = f"{task.name}: no run on another home; send one (--frames {OTHER})"
                yield Problem(self.name, text, is_warning=True)
            elif not self._is_above(task, control):
                text = f"{task.name}: is not above the same model's score on another home"
                yield Problem(self.name, text, is_warning=True)

    @staticmethod
    def _is_above(task: Expected, control: Expected) -> bool:
        theirs = {it.key: it.payload.scores.get("strict", 0.0) for it in control.graded}
        shared = [it for it in task.graded if it.key in theirs]
        difference = paired_difference(
            [theirs[it.key] for it in shared],
            [it.payload.scores.get("strict", 0.0) for it in shared],
            [it.cluster for it in shared],
            most=1.0,
        )
        low = difference.estimate.low
        return low is not None and low > 0
