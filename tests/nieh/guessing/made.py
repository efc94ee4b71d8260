"""Questions of small sets, and what is right about guesses at them."""

from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.guessing.guesses import sample_on_clues


def asked(
    traj_id: str, text: str, answer: str, clues: tuple[int, ...] = (1,), file: str = ""
) -> Question:
    return Question(traj_id, text, clues, (answer,), file=file)


def on_clues(*questions: Question) -> list[Sample]:
    return [sample_on_clues(question) for question in questions]
