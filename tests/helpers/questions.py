"""Questions of small sets."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.guessing.blind import sample_on_clues
from infthor_eval.nieh.guessing.folds import Fit
from infthor_eval.nieh.guessing.guessers import Knowledge, NamedGuesser

__all__ = ["guess_with", "make_question", "make_samples_on_clues"]


def make_question(
    traj_id: str = "t",
    text: str = "Is there a mug?",
    answer: str = "yes",
    clues: Iterable[int] = (1,),
    **columns: Any,
) -> Question:
    """A question with one answer; `columns` are further fields of `Question`."""
    return Question(traj_id, text, tuple(clues), (answer,), **columns)


def make_samples_on_clues(*questions: Question) -> list[QuestionVariant]:
    """A sample of each question, whose window is its clues."""
    return [sample_on_clues(question) for question in questions]


def guess_with(
    rule: Callable[..., Fit],
    samples: Sequence[QuestionVariant],
    scenes: Mapping[str, str] | None = None,
    **knowledge: Any,
) -> list[str]:
    """What a guesser of that rule says to samples, held out in folds."""
    guesser = NamedGuesser("", Knowledge.WORDS, partial(rule, **knowledge))
    return guesser.guess(samples, scenes or {})
