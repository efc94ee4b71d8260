"""What a check is given, and what it is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from infthor_board.expected import Expected
from infthor_board.reading import Problem, Submission
from infthor_eval.nieh.options import SHOWN

_FEW = 3  # examples in a reason


@dataclass(frozen=True)
class Case:
    """A submission with what its runs should have.

    Attributes:
        submission: the submission.
        tasks: the tasks of all its runs, those that could be set up.
        is_candidate: False for one that is there to be compared with alone.
    """

    submission: Submission
    tasks: Sequence[Expected]
    is_candidate: bool = True

    @property
    def shown(self) -> list[Expected]:
        """Tasks that were asked with their own frames."""
        return [task for task in self.tasks if task.run.header.config.frames in ("", SHOWN)]

    def controls(self, frames: str) -> list[Expected]:
        """Return tasks that were asked with this frame ablation."""
        return [task for task in self.tasks if task.run.header.config.frames == frames]


class Check(Protocol):
    """A check.

    Attributes:
        name: its name in reasons.
        reason: why it is made, in a line.
    """

    name: ClassVar[str]
    reason: ClassVar[str]

    def problems(self, case: Case, others: Sequence[Case]) -> Iterator[Problem]:
        """Yield why the submission is refused, or what is to be known of it.

        Args:
            case: the submission.
            others: all other submissions.
        """


def count(what: str, names: Sequence[str]) -> str:
    """Return "3 WHAT (a, b, c)", with the first few names."""
    listed = ", ".join(names[:_FEW]) + (", ..." if len(names) > _FEW else "")
    return f"{len(names):,} {what} ({listed})"
