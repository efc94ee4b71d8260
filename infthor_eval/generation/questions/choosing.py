"""The balanced choice of questions, so that the answers cannot be guessed from the words of the
questions.

No answer to a form is more frequent than the next ones: than the next for yes and no, the next two
for numbers, the next four for other answers. The same holds for the answers on each object in each
kind of room, as "the fridge was open" or "there is a sofa" would hold in most kitchens and living
rooms, whatever the form.
"""

import random
from collections import Counter
from collections.abc import Iterable

from infthor_eval.generation.questions.candidates import Candidate

__all__ = ["Chooser"]

_YES_NO = ("yes", "no")
_NEXT_NUMBERS = 3
_NEXT_ANSWERS = 6


class Chooser:
    """Chooses questions so that types, forms, answers, numbers of clues and subjects are balanced
    over a set."""

    def __init__(self, *, by_subject: bool = True) -> None:
        """Start a set.

        Args:
            by_subject: False for more questions: no answer yes, no or number is more frequent than
                all others to its form together, and that is all.
        """
        self._by_subject = by_subject
        self._types: Counter[str] = Counter()
        self._groups: Counter[str] = Counter()
        self._clues: Counter[int] = Counter()
        self._answers: dict[tuple[str, ...], Counter[str]] = {}
        self._subjects: Counter[tuple[str, str]] = Counter()

    def choose(
        self, candidates: Iterable[Candidate], number: int, rng: random.Random, rooms: str
    ) -> list[Candidate]:
        """Choose up to a number of questions on one trajectory in rooms of some kinds."""
        remaining = list(candidates)
        rng.shuffle(remaining)  # ties are broken by this order
        chosen: list[Candidate] = []
        # A limit per group: presence questions, which are always possible, must not fill up quiet
        # trajectories.
        limits = Counter({_group(item): max(2, number // 5) for item in remaining})
        while len(chosen) < number:
            eligible = [
                item
                for item in remaining
                if limits[_group(item)] and not self._is_unbalanced(item, rooms)
            ]
            if not eligible:
                break
            best = min(eligible, key=self._use)
            remaining.remove(best)
            limits[_group(best)] -= 1
            chosen.append(best)
            self._count(best, rooms)
        return sorted(chosen, key=lambda item: (item.clues, item.text))

    def _is_unbalanced(self, item: Candidate, rooms: str) -> bool:
        """Return True if the answer already leads the next ones, to the form or on a subject."""
        if not self._by_subject and not item.is_closed:
            return False
        return any(
            self._leads(self._answers.get(key, Counter()), item) for key in self._keys(item, rooms)
        )

    def _leads(self, answers: Counter[str], item: Candidate) -> bool:
        """Return True if the answer is more frequent than the mean of the next ones."""
        answer = _answer(item)
        others = sorted(
            (count for other, count in answers.items() if other != answer), reverse=True
        )
        if not self._by_subject:
            return answers[answer] > sum(others)
        n_next = 1 if answer in _YES_NO else _NEXT_NUMBERS if item.is_closed else _NEXT_ANSWERS
        return n_next * answers[answer] > sum(others[:n_next])

    def _keys(self, item: Candidate, rooms: str) -> list[tuple[str, ...]]:
        """Return what the answer is counted by."""
        if not self._by_subject:
            return [(item.form,)]
        answers = {str(answer).replace(" ", "").lower() for answer in item.answers}
        asked = [subject for subject in item.subjects if subject.lower() not in answers]
        return [(item.form,), *((item.question_type, rooms, subject) for subject in asked)]

    def _count(self, item: Candidate, rooms: str) -> None:
        group = _group(item)
        self._types[item.question_type] += 1
        self._groups[group] += 1
        self._clues[_clue_class(item)] += 1
        self._subjects.update((group, subject) for subject in item.subjects)
        for key in self._keys(item, rooms):
            self._answers.setdefault(key, Counter())[_answer(item)] += 1

    def _use(self, item: Candidate) -> tuple[int, int, int, int]:
        group = _group(item)
        subjects = sum(self._subjects[group, subject] for subject in item.subjects)
        return (
            self._types[item.question_type],
            self._groups[group],
            self._clues[_clue_class(item)],
            subjects,
        )


def _answer(item: Candidate) -> str:
    return ", ".join(sorted(map(str, item.answers)))


def _group(item: Candidate) -> str:
    """Return the group that is balanced within a question type: yes, no, or other answers."""
    return (
        f"{item.question_type} {item.answers[0]}"
        if item.answers[0] in _YES_NO
        else item.question_type
    )


def _clue_class(item: Candidate) -> int:
    return min(len(item.clues), 3)
