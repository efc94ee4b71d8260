"""What a check is given, and what it is."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

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
        others: all other submissions.
    """

    submission: Submission
    tasks: Sequence[Expected]
    is_candidate: bool = True
    others: Sequence["Case"] = ()

    @property
    def shown(self) -> list[Expected]:
        """Tasks that were asked with their own frames."""
        return [task for task in self.tasks if task.run.header.config.frames in ("", SHOWN)]


class Remark(str):
    """What is to be known of a submission, and does not refuse it."""


@dataclass(frozen=True)
class Check:
    """A check.

    Attributes:
        name: its name in reasons.
        reasons: yields why a submission is refused, or what is to be known of it.
    """

    name: str
    reasons: Callable[[Case], Iterator[str]]

    def problems(self, case: Case) -> Iterator[Problem]:
        """Yield the reasons under the name of the check."""
        for reason in self.reasons(case):
            yield Problem(self.name, str(reason), is_warning=isinstance(reason, Remark))


def check(name: str) -> Callable[[Callable[[Case], Iterator[str]]], Check]:
    """Make a check of a function that yields its reasons."""
    return partial(Check, name)


def count(what: str, names: Sequence[str]) -> str:
    """Return "3 WHAT (a, b, c)", with the first few names."""
    listed = ", ".join(names[:_FEW]) + (", ..." if len(names) > _FEW else "")
    return f"{len(names):,} {what} ({listed})"
