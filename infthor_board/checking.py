"""Checking submissions: each by itself, and each against all others."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from infthor_board.case import Case, Check
from infthor_board.checks import replies, requests, runs
from infthor_board.expected import Expected, Owner
from infthor_board.reading import Problem, Submission, describe, read_submission
from infthor_board.statement import find_submissions

CHECKS = (
    runs.complete_identity,
    runs.same_model,
    runs.unedited_config,
    runs.same_set,
    runs.same_task,
    runs.all_there,
    runs.asked_once,
    runs.none_of_another_set,
    runs.same_scorers,
    runs.same_scores,
    runs.same_results,
    requests.same_requests,
    replies.copied_records,
    replies.copied_replies,
    replies.key_form,
    replies.key_spelling,
    replies.key_words,
    replies.key_score,
    replies.pairs_of_what_differs,
    replies.pairs_of_both_worlds,
    replies.pairs_with_singles,
    replies.not_above_blind,
    replies.not_above_other_home,
)


@dataclass(frozen=True)
class Verdict:
    """What the checks say of a submission.

    Attributes:
        case: the submission, with what its runs should have.
        problems: why it is refused, and what is to be known of it.
    """

    case: Case
    problems: Sequence[Problem]

    @property
    def refusals(self) -> list[Problem]:
        """Why it is refused; none if it passes."""
        return [problem for problem in self.problems if not problem.is_warning]

    @property
    def warnings(self) -> list[Problem]:
        """What is to be known of it."""
        return [problem for problem in self.problems if problem.is_warning]


def check_submissions(
    folder: Path, owner: Owner, others: Path | None = None, allowed: Sequence[str] = ()
) -> list[Verdict]:
    """Check the submission in a folder, or all in it, in the order of their names.

    Args:
        folder: a submission, or a folder of submissions.
        owner: who checks, with the tasks and sets.
        others: folder of earlier submissions, which no reply may be copied from.
        allowed: names of checks that warn in place of refusing, as the owner has looked.
    """
    cases = [_open(path, owner) for path in find_submissions(folder)]
    earlier = [] if others is None else _earlier(cases, find_submissions(others), owner)
    verdicts = []
    for case in cases:
        rivals = [it for it in cases if it is not case] + earlier
        problems = [*case.submission.problems]
        for check in CHECKS:
            problems += _problems(check, replace(case, others=rivals))
        verdicts.append(Verdict(case, [_allow(problem, allowed) for problem in problems]))
    return verdicts


def _earlier(cases: Sequence[Case], folders: Sequence[Path], owner: Owner) -> list[Case]:
    own = {case.submission.folder.resolve() for case in cases}
    return [
        replace(_open(path, owner), is_candidate=False)
        for path in folders
        if path.resolve() not in own
    ]


def _open(folder: Path, owner: Owner) -> Case:
    submission = read_submission(folder, owner.find_set)
    tasks: list[Expected] = []
    problems = list(submission.problems)
    for run in submission.runs:
        try:
            tasks += owner.expect(run)
        except Exception as error:  # noqa: BLE001 - see `describe`
            problems.append(Problem("readable", f"{run.path.name}: {describe(error)}"))
    known: Submission = replace(submission, problems=problems)
    return Case(known, tasks)


def _problems(check: Check, case: Case) -> Iterator[Problem]:
    """Yield the problems of a check; one that cannot be made refuses, and stops no other."""
    try:
        yield from check.problems(case)
    except Exception as error:  # noqa: BLE001 - see `describe`
        yield Problem(check.name, f"cannot be checked: {describe(error)}")


def _allow(problem: Problem, allowed: Sequence[str]) -> Problem:
    return replace(problem, is_warning=True) if problem.check in allowed else problem
