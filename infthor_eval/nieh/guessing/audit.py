"""The audit of a set: what guessers that see no frame, `blind` one of them, get of its questions.

Each question is guessed twice: without its trajectory, and without all trajectories of its scene,
as a model that is tuned on other homes would know them.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import type_of
from infthor_eval.grouping import grouped
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.blind import (
    questions_by_file,
    sample_on_clues,
    score_guesses,
    visible_knowledge,
)
from infthor_eval.nieh.guessing.chains import form_of
from infthor_eval.nieh.guessing.clue_facts import read_clue_facts, read_scenes
from infthor_eval.nieh.guessing.folds import held_out
from infthor_eval.nieh.guessing.guessers import GUESSERS, blind_guesser, facts_guesser
from infthor_eval.nieh.scoring import score

_YES_NO = ("yes", "no")
_MANY = 20  # questions of a group that a sentence is worth


@dataclass(frozen=True)
class AuditedQuestion:
    """A question with the strict scores of the audit's guessers, in their order.

    Attributes:
        question: the question.
        scores: scores of guesses that are learned on other trajectories.
        scene_scores: scores of guesses that are learned on other scenes; empty if the set does not
            tell its scenes.
    """

    question: Question
    scores: tuple[float, ...]
    scene_scores: tuple[float, ...] = ()


@dataclass(frozen=True)
class Group:
    """Some questions of a set.

    Attributes:
        by: what they share: file, type, form or clues.
        name: the file, type, form or column itself.
        guessers: names of the guessers.
        questions: the questions.
    """

    by: str
    name: str
    guessers: Sequence[str]
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
        """Mean score of an answer that is drawn from those of a question's form (`chance_of`)."""
        by_form = grouped((form_of(it.question), it.question) for it in self.questions)
        total = sum(chance_of(questions) * len(questions) for questions in by_form.values())
        return total / len(self.questions)

    def means(self) -> tuple[float, ...]:
        """Return the mean score of each guesser; the last is that of `blind`."""
        return _means([audited.scores for audited in self.questions])

    def pair_means(self) -> tuple[float, ...]:
        """Return the share of pairs of twins that each guesser has right in both worlds.

        It is empty if no question of the group is paired with another of it.
        """
        pairs = grouped((it.question.pair, it.scores) for it in self.questions if it.question.pair)
        rows = []
        for scores in pairs.values():
            if len(scores) == 2:
                both = zip(*scores, strict=True)
                rows.append(tuple(float(min(sides) >= 1) for sides in both))
        return _means(rows)

    def best(self) -> tuple[str, float]:
        """Return the name of the best guesser, the simplest of equals, and its score."""
        means = self.means()
        best = max(range(len(means)), key=means.__getitem__)
        return self.guessers[best], means[best]

    def best_without_scene(self) -> float | None:
        """Return the best guesser's score without the question's scene; None if that is unknown."""
        return max(_means([audited.scene_scores for audited in self.questions]), default=None)


def _means(rows: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(sum(column) / len(rows) for column in zip(*rows, strict=True))


def chance_of(questions: Sequence[Question], *, own: bool = False) -> float:
    """Return the mean strict score of an answer that is drawn from those to questions of one form.

    It is drawn from the different answers on other trajectories, or to other questions if all are
    on one; of none it is 0. A list that is drawn has partial credit, so for lists this is more than
    one over their number.

    Args:
        questions: the questions.
        own: draw from all of their answers, the question's own included.
    """
    samples = list(map(sample_on_clues, questions))
    groups = list(map(held_out(samples), samples))
    holders: dict[str, set[str]] = {}  # of each answer, those who have it
    for question, group in zip(questions, groups, strict=True):
        holders.setdefault(doc_target(question).lower(), set()).add(group)
    totals: defaultdict[int, float] = defaultdict(float)  # by the number of answers drawn from
    golds = Counter((it.answers, group) for it, group in zip(questions, groups, strict=True))
    scored = cache(partial(score, scorer="strict"))
    for (gold, group), n in golds.items():
        drawn = [answer for answer, has in holders.items() if own or has != {group}]
        totals[len(drawn)] += n * sum(scored(answer, gold) for answer in drawn)
    return sum(total / n for n, total in totals.items() if n) / len(questions)


def _yes_no(question: Question) -> str:
    return "yes/no" if doc_target(question).lower() in _YES_NO else "open-ended"


BY: Mapping[str, Callable[[Question], str]] = {
    "file": lambda question: question.file or "all",
    "answers": _yes_no,
    "clues": lambda question: question.clue_column or "total alone",
    "type": lambda question: question.question_type or type_of(question.text) or "untyped",
    "form": form_of,
}


@dataclass(frozen=True)
class Audit:
    """What can be guessed of a set.

    Attributes:
        guessers: names of the guessers, from the simplest on; the last is `blind`.
        questions: the questions that can be asked, file by file.
    """

    guessers: Sequence[str]
    questions: Sequence[AuditedQuestion]

    def groups(self, by: str) -> list[Group]:
        """Return groups of questions; of several files, all but whole files are split by file."""
        split: dict[str, list[AuditedQuestion]] = {}
        for audited in self.questions:
            name = BY[by](audited.question)
            file = audited.question.file
            split.setdefault(f"{file}: {name}" if file and by != "file" else name, []).append(
                audited
            )
        return [Group(by, name, self.guessers, items) for name, items in sorted(split.items())]

    def sentences(self) -> Iterator[str]:
        """Yield what is striking about the set, in sentences."""
        for group in self.groups("answers"):
            file, _, _ = group.name.rpartition(": ")
            where = f"of {file}" if file else "of this set"
            if group.share_yes in (0, 1) and len(group.questions) >= _MANY:
                answer = "yes" if group.share_yes else "no"
                yield f"All {len(group.questions)} yes/no questions {where} are {answer}."
        for group in self.groups("form"):
            if len(group.questions) >= _MANY:
                yield from _sentences_on_form(group)
        for group in self.groups("file"):
            yield f"{group.name}: blind has {100 * group.means()[-1]:.2f} % without a frame."


def _sentences_on_form(group: Group) -> Iterator[str]:
    name, mean = group.best()
    n = len(group.questions)
    if len(group.answers) == 1:
        yield f"{group.name} ({n} questions): the answer is always {next(iter(group.answers))}."
    elif mean > 0.9:
        yield f"{group.name} ({n} questions): {name} gets {100 * mean:.1f} % without a frame."


def audit(data: NiehSet) -> Audit:
    """Guess each question of a set that can be asked, in all ways that the set allows."""
    facts = read_clue_facts(data)
    scenes = read_scenes(data)
    blind = blind_guesser(visible_knowledge("clues"))
    guessers = (*GUESSERS, *([facts_guesser(facts)] if facts else []), blind)
    audited: list[AuditedQuestion] = []
    for questions in questions_by_file(data).values():
        scores = score_guesses(questions, guessers)
        of_scenes = score_guesses(questions, guessers, scenes) if scenes else [()] * len(questions)
        audited += map(AuditedQuestion, questions, scores, of_scenes)
    return Audit([guesser.name for guesser in guessers], audited)
