"""A large part of a set in which guessing without frames does not help.

The algorithm is iterative pruning, as in the debiased sets of Brown et al. (arXiv:2511.04655). The
part is one file, so all questions count as one file here. Chance is the mean score of an answer
that is drawn from those that a form has in the part.

1. In each form the commonest answer is cut to chance and 3 points: of all ways to keep the k
   commonest answers, each up to some number of questions, the one that keeps most. A form with one
   answer alone goes.
2. All guessers guess what is left, each question from other trajectories. In each form where one of
   them is more than 3 points above chance, the questions that most guessers get right go, half as
   many as are too many; then step 1 again.
3. It ends when no guesser is more than 3 points above chance in any form.

It is greedy: a larger part may exist.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from infthor_eval.formats.question import Question
from infthor_eval.grouping import grouped
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.audit import chance_of
from infthor_eval.nieh.guessing.blind import score_guesses
from infthor_eval.nieh.guessing.chains import form_of
from infthor_eval.nieh.guessing.guessers import GUESSERS

MARGIN = 0.03


@dataclass(frozen=True)
class Balanced:
    """A balanced part of a set.

    Attributes:
        questions: the questions, in the order of the set.
        chance: mean over them of one over the number of answers of their form.
        best: name of the best guesser on them all.
        best_score: its mean score.
        kept: number of questions that were kept, and that there were, by form and, in a set of
            several, file.
    """

    questions: Sequence[Question]
    chance: float
    best: str
    best_score: float
    kept: Mapping[str, tuple[int, int]]


def balance(questions: Sequence[Question]) -> Balanced:
    """Return the balanced part of some questions, each once; it may be empty."""
    before = Counter(map(_name, questions))
    different: dict[str, Question] = {}
    for question in questions:
        different.setdefault(replace(question, published=None).id, question)
    left = _cut_answers(list(different.values()))
    right = _guess(left)
    while surplus := _surplus(left, right):
        left = _cut_answers(_prune(left, right, surplus))
        right = _guess(left)
    after = Counter(map(_name, left))
    kept = {name: (after[name], n) for name, n in sorted(before.items())}
    if not left:
        return Balanced((), 0.0, "none", 0.0, kept)
    means = [n_right / len(left) for n_right in _right_by_guesser(left, right)]
    best = max(range(len(means)), key=means.__getitem__)
    by_form = _by_form(left)
    chance = sum(chance_of(group, own=True) * len(group) for group in by_form.values()) / len(left)
    return Balanced(left, chance, GUESSERS[best].name, means[best], kept)


def _name(question: Question) -> str:
    return f"{question.file}: {form_of(question)}" if question.file else form_of(question)


def _by_form(questions: Sequence[Question]) -> dict[str, list[Question]]:
    return grouped((form_of(question), question) for question in questions)


def _cut_answers(questions: Sequence[Question]) -> list[Question]:
    """Return the questions without those that step 1 cuts; of too many the first ones are kept."""
    chosen: set[str] = set()
    for group in _by_form(questions).values():
        by_answer = grouped((doc_target(question), question) for question in group)
        commonest = sorted(by_answer.values(), key=len, reverse=True)
        n_answers, most = _best_cut([len(of_answer) for of_answer in commonest])
        chosen |= {
            question.id for of_answer in commonest[:n_answers] for question in of_answer[:most]
        }
    return [question for question in questions if question.id in chosen]


def _best_cut(sizes: Sequence[int]) -> tuple[int, int]:
    """Return how many of the commonest answers to keep (0: none), and how many questions of each.

    Args:
        sizes: number of questions of each answer, descending.
    """
    best = (0, 0)
    kept = 0
    for n_answers in range(2, len(sizes) + 1):
        for most in range(sizes[0], 0, -1):
            total = sum(min(size, most) for size in sizes[:n_answers])
            if most <= (1 / n_answers + MARGIN) * total:
                best, kept = ((n_answers, most), total) if total > kept else (best, kept)
                break
    return best


def _guess(questions: Sequence[Question]) -> dict[str, tuple[float, ...]]:
    """Return each question's scores by guesser."""
    ids = [question.id for question in questions]
    return dict(zip(ids, score_guesses(questions) if questions else [], strict=True))


def _right_by_guesser(
    questions: Sequence[Question], right: Mapping[str, tuple[float, ...]]
) -> list[float]:
    """Return how many of the questions each guesser gets right."""
    scores = [right[question.id] for question in questions]
    return [sum(of_guesser) for of_guesser in zip(*scores, strict=True)]


def _surplus(
    questions: Sequence[Question], right: Mapping[str, tuple[float, ...]]
) -> dict[str, int]:
    """Return half of what each form's best guesser gets beyond chance, where above the margin."""
    surplus = {}
    for form, group in _by_form(questions).items():
        # Without a question's own answer, of few trajectories nearly all others are wrong, and
        # questions would go until none is left.
        chance = chance_of(group, own=True)
        best = max(_right_by_guesser(group, right))
        if best > (chance + MARGIN) * len(group):
            surplus[form] = max(1, round((best - chance * len(group)) / 2))
    return surplus


def _prune(
    questions: Sequence[Question],
    right: Mapping[str, tuple[float, ...]],
    surplus: Mapping[str, int],
) -> list[Question]:
    """Return the questions without those, in forms with a surplus, that most guessers get right."""
    gone: set[str] = set()
    for form, group in _by_form(questions).items():
        # Stable: the first of equals.
        easiest = sorted(group, key=lambda question: -sum(right[question.id]))
        gone |= {question.id for question in easiest[: surplus.get(form, 0)]}
    return [question for question in questions if question.id not in gone]
