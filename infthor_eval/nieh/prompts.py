"""What a model is told, in the words of the published evaluation."""

from infthor_eval.formats.question import Question

__all__ = ["last_line", "question_text"]

_FORM = "Do not include explanation or reasoning in the answer. Answer with a single word or words."


def question_text(intro: str, question: Question) -> str:
    """The text that follows a context, beginning with the line break that ends it.

    Args:
        intro: the context's sentence about what was seen.
        question: what is asked.
    """
    return f"\n{intro} {_FORM}\nQuestion: {question.text}"


def last_line(response: str) -> str:
    """The part of a response that counts: its last line."""
    return response.strip().rpartition("\n")[2].strip()
