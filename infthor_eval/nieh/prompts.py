"""What a model is told: in the words of the published evaluation, and for notes, which it lacks, in our own."""

from infthor_eval.formats.question import Question

__all__ = ["last_line", "note_text", "question_text"]

_FORM = "Do not include explanation or reasoning in the answer. Answer with a single word or words."


def question_text(intro: str, question: Question) -> str:
    """The text that follows a context, beginning with the line break that ends it.

    Args:
        intro: the context's sentence about what was seen.
        question: what is asked.
    """
    return f"\n{intro} {_FORM}\nQuestion: {question.text}"


def note_text(steps: str) -> str:
    """The text that follows the frames of a window and asks for a note on them.

    Args:
        steps: the window's steps, as "Steps 0-19".
    """
    return (
        f"\n{steps} of an embodied agent's trajectory, one view per step in time order. You will be asked about them "
        "later without seeing them. Note in a few short phrases which room it is, which objects are where, how many of "
        "them and in which state, and what the agent does with them.\nNote: "
    )


def last_line(response: str) -> str:
    """The part of a response that counts: its last line."""
    return response.strip().rpartition("\n")[2].strip()
