"""The audit of a set: what guessers that see no frame get in each group of its questions."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import type_of
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.chains import form_of
from infthor_eval.nieh.guessing.guessers import GUESSERS
from infthor_eval.nieh.guessing.guesses import questions_by_file, score_guesses
from infthor_eval.nieh.scoring import Scorer

__all__ = ["BY", "AuditedQuestion", "Group", "audit", "groups", "sentences"]

_YES_NO = ("yes", "no")
_MANY = 20  # questions of a group that a sentence is worth


@dataclass(frozen=True)
class AuditedQuestion:
    """A question with the scores of the guessers, in the order of `GUESSERS`."""

    question: Question
    scores: tuple[float, ...]


@dataclass(frozen=True)
class Group:
    """Some questions of a set.

    Attributes:
        by: what they share: file, type, form or clues.
        name: the file, type, form or column itself.
        questions: the questions.
    """

    by: str
    name: str
    questions: Sequence[AuditedQuestion]

    @property
    def answers(self) -> Counter[str]:
        """The answers in lower case, with the number of questions that have each."""
        return Counter(doc_target(audited.question).lower() for audited in self.questions)

    @property
    def entropy(self) -> float:
        """Entropy of the answers in bits; 0 if they are all the same."""
        n = len(self.questions)
        return abs(sum(count / n * math.log2(n / count) for count in self.answers.values()))

    @property
    def share_yes(self) -> float | None:
        """Share of yes among the answers yes and no; None if there are none."""
        n_yes_or_no = sum(self.answers[answer] for answer in _YES_NO)
        return self.answers["yes"] / n_yes_or_no if n_yes_or_no else None

    @property
    def chance(self) -> float:
        """Mean over the questions of one over the number of answers that their form has here."""
        answers: dict[str, set[str]] = {}
        for audited in self.questions:
            answers.setdefault(form_of(audited.question), set()).add(
                doc_target(audited.question).lower()
            )
        return sum(1 / len(answers[form_of(audited.question)]) for audited in self.questions) / len(
            self.questions
        )

    def means(self) -> tuple[float, ...]:
        """Return the mean score of each guesser."""
        columns = zip(*(audited.scores for audited in self.questions), strict=True)
        return tuple(sum(column) / len(self.questions) for column in columns)

    def best(self) -> tuple[str, float]:
        """Return the name of the best guesser, the simplest of equals, and its score."""
        means = self.means()
        best = max(range(len(means)), key=means.__getitem__)
        return GUESSERS[best].name, means[best]


def audit(data: NiehSet, scorer: Scorer = "strict") -> list[AuditedQuestion]:
    """Return a set's questions that can be asked, with the guessers' scores, file by file."""
    return [
        AuditedQuestion(question, scores)
        for questions in questions_by_file(data).values()
        for question, scores in zip(questions, score_guesses(questions, scorer), strict=True)
    ]


def _yes_no(question: Question) -> str:
    return "yes/no" if doc_target(question).lower() in _YES_NO else "open-ended"


BY: Mapping[str, Callable[[Question], str]] = {
    "file": lambda question: question.file or "all",
    "answers": _yes_no,
    "clues": lambda question: question.clue_column or "total alone",
    "type": lambda question: question.question_type or type_of(question.text) or "untyped",
    "form": form_of,
}


def groups(questions: Sequence[AuditedQuestion], by: str) -> list[Group]:
    """Return groups of questions; of several files, all but whole files are split by file."""
    split: dict[str, list[AuditedQuestion]] = {}
    for audited in questions:
        name = BY[by](audited.question)
        file = audited.question.file
        split.setdefault(f"{file}: {name}" if file and by != "file" else name, []).append(audited)
    return [Group(by, name, items) for name, items in sorted(split.items())]


def sentences(questions: Sequence[AuditedQuestion]) -> Iterator[str]:
    """Yield what is striking about a set, in sentences."""
    for group in groups(questions, "answers"):
        file, _, _ = group.name.rpartition(": ")
        where = f"of {file}" if file else "of this set"
        if group.share_yes in (0, 1) and len(group.questions) >= _MANY:
            answer = "yes" if group.share_yes else "no"
            yield f"All {len(group.questions)} yes/no questions {where} are {answer}."
    for group in groups(questions, "form"):
        if len(group.questions) < _MANY:
            continue
        name, mean = group.best()
        if len(group.answers) == 1:
            yield (
                f"{group.name} ({len(group.questions)} questions): the answer is always "
                f"{next(iter(group.answers))}."
            )
        elif mean > 0.9:
            yield (
                f"{group.name} ({len(group.questions)} questions): {name} gets {100 * mean:.1f} % "
                "without a frame."
            )
    for group in groups(questions, "file"):
        name, mean = group.best()
        yield f"{group.name}: {100 * mean:.2f} % can be had without a frame ({name})."
