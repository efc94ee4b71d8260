"""Replies to NIEH questions as logs of others have them, whatever the form of the log."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from infthor_eval.formats.question import Question
from infthor_eval.quantities import MOST_REPEATS

Texts = Annotated[tuple[str, ...], Meta(max_length=MOST_REPEATS)]  # of one question, in one row


@dataclass(frozen=True)
class LoggedReply:
    """A reply to a question, and what the row says of both.

    What a form does not tell is at its default.

    Attributes:
        line: number of the line, from 1.
        text: the reply.
        question_id: id of the question; None if the row has its number instead.
        row: number of the question in its file, from 0; None if the row has an id.
        published: the question as a published row repeats it; None in other forms.
        score: score in the log; None if there is none.
        mode: published name of the evaluation mode (`truncate_head`); None if the row names none.
        size: size of the context in kilo-tokens, in published rows.
        n_frames: number of frames that the model saw, in published rows.
        frames: numbers of these frames; None if they are not in the row.
        n_context_tokens: tokens of the request; None if they are not in the row.
        n_reply_tokens: tokens of the reply; None likewise.
        seconds: duration; 0 if it is not in the row.
        thinking: what the model thought before it; None if it did not.
        failure: why there is no reply, which is empty then; None if there is one.
        model: name of the model.
        task: name of the task that asked.
        context: name of its context.
        frame_ablation: what replaced the frames; empty where they were shown.
        variant: variant of the context.
        repeat: number of the repetition, from 1.
    """

    line: int
    text: str
    question_id: str | None = None
    row: int | None = None
    published: Question | None = None
    score: float | None = None
    mode: str | None = None
    size: float | None = None
    n_frames: int | None = None
    frames: tuple[int, ...] | None = None
    n_context_tokens: int | None = None
    n_reply_tokens: int | None = None
    seconds: float = 0.0
    thinking: str | None = None
    failure: str | None = None
    model: str = ""
    task: str = ""
    context: str = ""
    frame_ablation: str = ""
    variant: str = ""
    repeat: int = 1


@dataclass(frozen=True)
class UnreadRow:
    """A line that is not a reply, with the reason."""

    line: int
    reason: str
