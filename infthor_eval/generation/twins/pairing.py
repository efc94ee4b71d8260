"""Questions in the same words that have another answer in each of two worlds."""

import random
from collections.abc import Iterable, Mapping, Sequence

from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import Step
from infthor_eval.formats.twins import PairedQuestion
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import candidates_of, further_candidates_of
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.household.wording import canonical_type, compact_name

__all__ = ["Overlap", "pair_questions"]

Overlap = "Callable[[str, Sequence], float]"


def pair_questions(
    logs: tuple[Sequence[Step], Sequence[Step]],
    vocabulary: frozenset[str],
    types: frozenset[str],
    rng: random.Random,
    overlap,
) -> list[PairedQuestion]:
    """Return the questions on the changed fact that both worlds allow, with both answers.

    Args:
        logs: the logs of the two worlds.
        vocabulary: object types of rooms of the kind, for absences.
        types: object types that the fact is about.
        rng: for the draws of the rules.
        overlap: returns the strict score of a reply for gold answers.
    """
    seed = rng.random()
    asked = [_candidates(log, vocabulary, random.Random(seed)) for log in logs]
    checkers = [Checker(log, DEFAULT_SHARE) for log in logs]
    names = {compact_name(canonical_type(name)) for name in types}
    paired = []
    for text, first in sorted(asked[0].items()):
        second = asked[1].get(text)
        if second is None or not _is_about(first, second, types, names):
            continue
        scores = _overlaps(first, second, overlap)
        if max(scores) >= 1:
            continue
        clues = tuple(sorted({*first.clues, *second.clues}))
        if all(
            _is_confirmed(checker, candidate, clues)
            for checker, candidate in zip(checkers, (first, second), strict=True)
        ):
            paired.append(_paired(first, second, clues, scores))
    return paired


def _candidates(
    log: Sequence[Step], vocabulary: frozenset[str], rng: random.Random
) -> Mapping[str, Candidate]:
    history = TrajectoryHistory("twin", list(log))
    candidates = [*candidates_of(history, vocabulary, rng), *further_candidates_of(history, rng)]
    return {candidate.text: candidate for candidate in candidates}


def _is_about(
    first: Candidate, second: Candidate, types: Iterable[str], names: Iterable[str]
) -> bool:
    """Return True if a question asks about the changed objects, or its answers differ in them.

    What else differs is a side effect.
    """
    asked_of = {canonical_type(name) for name in first.subjects if _is_named(name, first)}
    if asked_of & set(map(canonical_type, types)):
        return True
    differing = set(map(str, first.answers)) ^ set(map(str, second.answers))
    return bool(differing) and differing <= set(names)


def _is_named(object_type: str, candidate: Candidate) -> bool:
    return compact_name(canonical_type(object_type)) not in set(map(str, candidate.answers))


def _overlaps(first: Candidate, second: Candidate, overlap) -> tuple[float, float]:
    return (
        overlap(_reply(first), second.answers),
        overlap(_reply(second), first.answers),
    )


def _reply(candidate: Candidate) -> str:
    return ", ".join(map(str, candidate.answers))


def _is_confirmed(checker: Checker, candidate: Candidate, clues: tuple[int, ...]) -> bool:
    """Return True if the checker gives the answer from all frames, and from the shared clues."""
    question = candidate.question("twin")
    shared = Question("twin", question.text, clues, question.answers, question.question_type)
    verdict = checker.verdict(shared)
    return verdict.right and verdict.sufficient


def _paired(
    first: Candidate, second: Candidate, clues: tuple[int, ...], scores: tuple[float, float]
) -> PairedQuestion:
    fact = ", ".join(sorted({_fact(candidate) for candidate in (first, second)}))
    return PairedQuestion(
        text=first.text,
        form=first.form,
        question_type=first.question_type,
        fact=fact,
        answers=(first.answers, second.answers),
        clues=clues,
        own_clues=(first.clues, second.clues),
        absence=(first.absence, second.absence),
        overlap=scores,
    )


def _fact(candidate: Candidate) -> str:
    named = sorted(name for name in candidate.subjects if _is_named(name, candidate))
    return named[0] if named else candidate.form
