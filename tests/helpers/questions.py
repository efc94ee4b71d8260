"""Questions of small sets."""

from collections.abc import Iterable
from typing import Any

from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.guessing.blind import sample_on_clues

__all__ = ["make_question", "make_samples_on_clues"]


def make_question(
    traj_id: str = "t",
    text: str = "Is there a mug?",
    answer: str = "yes",
    clues: Iterable[int] = (1,),
    **columns: Any,
) -> Question:
    """A question with one answer; `columns` are further fields of `Question`."""
    return Question(traj_id, text, tuple(clues), (answer,), **columns)


def make_samples_on_clues(*questions: Question) -> list[Sample]:
    """A sample of each question, whose window is its clues."""
    return [sample_on_clues(question) for question in questions]
