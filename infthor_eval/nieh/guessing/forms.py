"""Form and type of a question, by which guesses are counted."""

from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import find_form

__all__ = ["form_of", "question_type"]

_LEADING_WORDS = 2


def form_of(question: Question) -> str:
    """Return its form ("Is {} in/on {}?"), or what `question_type` returns if it has none of
    these."""
    form = find_form(question.text)
    return question_type(question) if form is None else form.words


def question_type(question: Question) -> str:
    """Return the question's type, or its leading words in lower case if the file names no type."""
    return question.question_type or " ".join(question.text.lower().split()[:_LEADING_WORDS])
