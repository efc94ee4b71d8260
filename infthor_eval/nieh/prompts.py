"""Prompts in the words of the published evaluation; for notes, which it lacks, in our own."""

from infthor_eval.formats.question import Question

__all__ = ["last_line", "note_text", "question_text"]

_FORM = "Do not include explanation or reasoning in the answer. Answer with a single word or words."


def question_text(intro: str, question: Question) -> str:
    """Return the text after a context, from the line break that ends it; `intro` is the context's first sentence."""
    return f"\n{intro} {_FORM}\nQuestion: {question.text}"


def note_text(steps: str) -> str:
    """Return the text that follows the frames of a window ("Steps 0-19") and asks for a note on them."""
    return (
        f"\n{steps} of an embodied agent's trajectory, one view per step in time order. You will be asked about them "
        "later without seeing them. Note in a few short phrases which room it is, which objects are where, how many of "
        "them and in which state, and what the agent does with them.\nNote: "
    )


def last_line(response: str) -> str:
    """Return the part of a response that counts: its last line."""
    return response.strip().rpartition("\n")[2].strip()
