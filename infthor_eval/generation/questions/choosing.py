"""The balanced choice of questions, so that their words do not give the answers away.

No answer to a form is more frequent than the next ones: than the next for yes and no, than the mean
of the next six for numbers, of the next ten for other answers. Answers of a list count one by one.
The same holds for the answers on each object in each kind of room, as "the fridge was open" or
"there is a sofa" would hold in most kitchens and living rooms, whatever the form.
"""

import random
from collections import Counter
from collections.abc import Iterable

from infthor_eval.generation.questions.candidates import Candidate

_YES_NO = ("yes", "no")
_NEXT_NUMBERS = 6
_NEXT_ANSWERS = 10


class Chooser:
    """Chooses questions with balanced types, forms, answers, numbers of clues and subjects."""

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
        limits = Counter({_group(candidate): max(2, number // 5) for candidate in remaining})
        while len(chosen) < number:
            eligible = [
                candidate
                for candidate in remaining
                if limits[_group(candidate)] and not self._is_unbalanced(candidate, rooms)
            ]
            if not eligible:
                break
            best = min(eligible, key=self._use)
            remaining.remove(best)
            limits[_group(best)] -= 1
            chosen.append(best)
            self._count(best, rooms)
        return sorted(chosen, key=lambda candidate: (candidate.clues, candidate.text))

    def _is_unbalanced(self, candidate: Candidate, rooms: str) -> bool:
        """Return True if the answer already leads the next ones, to the form or on a subject."""
        if not self._by_subject and not candidate.is_closed:
            return False
        return any(
            self._leads(self._answers.get(key, Counter()), candidate, answer)
            for key in self._keys(candidate, rooms)
            for answer in _answers(candidate)
        )

    def _leads(self, answers: Counter[str], candidate: Candidate, answer: str) -> bool:
        """Return True if an answer is more frequent than the mean of the next ones."""
        counts = (count for other, count in answers.items() if other != answer)
        others = sorted(counts, reverse=True)
        if not self._by_subject:
            return answers[answer] > sum(others)
        n_next = 1 if answer in _YES_NO else _NEXT_NUMBERS if candidate.is_closed else _NEXT_ANSWERS
        return n_next * answers[answer] > sum(others[:n_next])

    def _keys(self, candidate: Candidate, rooms: str) -> list[tuple[str, ...]]:
        """Return what the answer is counted by."""
        if not self._by_subject:
            return [(candidate.form,)]
        answers = {str(answer).replace(" ", "").lower() for answer in candidate.answers}
        subjects = [subject for subject in candidate.subjects if subject.lower() not in answers]
        return [
            (candidate.form,),
            *((candidate.question_type, rooms, subject) for subject in subjects),
        ]

    def _count(self, candidate: Candidate, rooms: str) -> None:
        group = _group(candidate)
        self._types[candidate.question_type] += 1
        self._groups[group] += 1
        self._clues[_clue_class(candidate)] += 1
        self._subjects.update((group, subject) for subject in candidate.subjects)
        for key in self._keys(candidate, rooms):
            self._answers.setdefault(key, Counter()).update(_answers(candidate))

    def _use(self, candidate: Candidate) -> tuple[int, int, int, int]:
        group = _group(candidate)
        subjects = sum(self._subjects[group, subject] for subject in candidate.subjects)
        return (
            self._types[candidate.question_type],
            self._groups[group],
            self._clues[_clue_class(candidate)],
            subjects,
        )


def _answers(candidate: Candidate) -> set[str]:
    """Return the answers of a list one by one: each that is guessed has its share of the score."""
    return set(map(str, candidate.answers))


def _group(candidate: Candidate) -> str:
    """Return the group that is balanced within a question type: yes, no, or other answers."""
    answer = candidate.answers[0]
    kind = candidate.question_type
    return f"{kind} {answer}" if answer in _YES_NO else kind


def _clue_class(candidate: Candidate) -> int:
    return min(len(candidate.clues), 3)
