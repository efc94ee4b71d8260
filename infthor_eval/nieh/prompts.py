"""What a model is told, in the words of the published evaluation."""

from collections.abc import Sequence

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question

__all__ = ["last_line", "question_text", "request_parts"]

_VIEWS = "Answer the question given the agent's views in time order."
_FORM = "Do not include explanation or reasoning in the answer. Answer with a single word or words."


def question_text(question: Question) -> str:
    """The text that follows the frames, beginning with the line break that ends them."""
    return f"\n{_VIEWS} {_FORM}\nQuestion: {question.text}"


def request_parts(frames: Sequence[FrameRef], question: Question) -> list[FrameRef | str]:
    """A whole request: the frames, then the text."""
    return [*frames, question_text(question)]


def last_line(response: str) -> str:
    """The part of a response that counts: its last line."""
    return response.strip().rpartition("\n")[2].strip()
