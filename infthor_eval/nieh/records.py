"""What NIEH writes into a run's journal: answers to questions, and notes that a model took."""

import msgspec

from infthor_eval.formats.question import Question
from infthor_eval.runs.records import RecordTypes

__all__ = ["RECORDS", "NiehAnswer", "NiehNote"]


class NiehAnswer(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, tag_field="type", tag="nieh_answer"):
    """A question, and what was said to it.

    Attributes:
        question: the question's text.
        question_type: its type, empty where the set names none.
        n_clues: number of frames that hold the evidence; 0 for an absence, which no frame proves.
        answers: the gold answers.
        reply: what the model said; None where it failed.
        scores: of the reply by metric, empty where there is none.
    """

    question: str
    question_type: str
    n_clues: int
    answers: tuple[str | int | float, ...]
    reply: str | None = None
    scores: dict[str, float] = {}

    @classmethod
    def of(cls, question: Question) -> "NiehAnswer":
        """What is known of a question before it is asked."""
        return cls(
            question=question.text,
            question_type=question.question_type or "",
            n_clues=question.n_clues,
            answers=question.answers,
        )

    def with_reply(self, reply: str, scores: dict[str, float]) -> "NiehAnswer":
        """The same question with a reply."""
        return msgspec.structs.replace(self, reply=reply, scores=scores)


class NiehNote(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", tag="nieh_note"):
    """What a model noted on a few frames of a trajectory, to be shown it later instead of them.

    Attributes:
        note: the text.
        traj_id: the trajectory.
        steps: which frames, as the model is told ("Steps 0-19").
        n_context_tokens: length of the request in tokens; None where the model does not tell.
        n_reply_tokens: length of the note in tokens; None likewise.
        seconds: time that it took.
    """

    note: str
    traj_id: str
    steps: str
    n_context_tokens: int | None
    n_reply_tokens: int | None
    seconds: float


RECORDS: RecordTypes[NiehAnswer] = RecordTypes(unit=NiehAnswer, artifact=NiehNote)
