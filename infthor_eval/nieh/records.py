"""Payloads of NIEH records: replies, what memories recalled and models wrote, judges' verdicts."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from infthor_eval.formats.question import Question
from infthor_eval.formats.question_forms import type_of
from infthor_eval.nieh.config import NiehConfig
from infthor_eval.quantities import Amount, Count, Number, Share, Whole
from infthor_eval.runs.journals.records import RecordTypes, Typed
from model_adapters import KeptCache

_Answers = tuple[str | Whole | Number, ...]


class BlindGuess(msgspec.Struct, frozen=True, kw_only=True):
    """What `blind` says to a question without a frame (`infthor_eval.nieh.guessing.blind`).

    Attributes:
        form: the question's form.
        reply: what it says.
        scores: scores of that by scorer.
        form_scores: means of these scores over the questions of that form in its file.
    """

    form: str
    reply: str = ""
    scores: dict[str, Number]
    form_scores: dict[str, Number]

    def __post_init__(self) -> None:
        """Check that both have the same scorers; msgspec turns the error into its own."""
        if self.scores.keys() != self.form_scores.keys():
            raise ValueError("`scores` and `form_scores` of `blind` are of different scorers")


class ShownClues(msgspec.Struct, frozen=True, kw_only=True):
    """How much of the evidence was among the shown frames.

    Attributes:
        n_shown: number of clue frames among them. Blank frames and those of another home count as
            what they stand for; those that are taken out or hidden do not.
        n_clues: number of different clue frames.
        n_after: number of frames of the trajectory after the last clue; None if its length is not
            known.
    """

    n_shown: Count
    n_clues: Count
    n_after: Count | None = None


class TwinSide(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One question of a pair of twins: what it is paired with, and how much of the change it shows.

    Attributes:
        pair: name of the pair of questions.
        fact: name of the changed fact; several pairs may be about one.
        kind: kind of the edit that made the pair of worlds.
        traj_id: name of this world's trajectory.
        answers: gold answers in the other world.
        n_frames: number of shown frames; None if they are not known, as of replies that others
            made.
        n_differing: number of these that differ between the worlds; likewise.
        n_after_clues: number of shown frames after the last clue; likewise.
        age: number of frames from the newest evidence, a frame of the trajectory that differs, to
            the one at which it is asked; None if none differs.
        span: number of frames from its oldest clue to the one at which it is asked.
        length: number of frames of the trajectory up to that one.
        scores: what the reply scores in the other world, by the task's own metrics; empty for ours,
            which `answers` tell.
    """

    pair: str
    fact: str
    kind: str
    traj_id: str
    answers: Annotated[_Answers, Meta(min_length=1)]
    n_frames: Count | None
    n_differing: Count | None
    n_after_clues: Count | None
    age: Count | None = None
    span: Count | None = None
    length: Count | None = None
    scores: dict[str, Number] = {}


class NiehRecall(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", tag="nieh_recall"):
    """What a memory recalled for a question.

    Attributes:
        recalled: positions of frames in the trajectory, and texts, in the order in which they are
            shown.
        build_s: seconds that the memory took to observe the trajectory, for all questions on it.
        recall_s: seconds that it took to recall this.
    """

    recalled: tuple[Count | str, ...]
    build_s: Amount
    recall_s: Amount

    @property
    def n_frames(self) -> int:
        """Number of recalled frames."""
        return sum(isinstance(position, int) for position in self.recalled)


class NiehAnswer(Typed, frozen=True, kw_only=True, tag="nieh_answer"):
    """A question and the reply to it.

    Attributes:
        question: the question's text.
        question_type: its type; that of its words if the set names none, empty if they are of no
            form of Table 3.
        n_clues: number of frames that are evidence; 0 for an absence.
        clue_column: column in the tables by number of clues (`Question.clue_column`).
        answers: the gold answers.
        file: name of its file, in a set of several; empty elsewhere.
        moment: number of the frame after which it is asked; None for the end.
        blind: what `blind` says to the question; None if it is not known.
        shown_clues: clue frames among the shown ones; None if they are not known, or if no frame is
            evidence.
        twin: what it is paired with; None for a question that is no twin.
        recall: what a memory recalled; None where the context has no memory.
        reply: the reply; None if the model failed.
        scores: scores of the reply by metric; empty if there is none.
        thinking: what the model thought before the reply, which is empty if it was cut off there;
            None if it did not.
        n_watched: different frames that a person looked at before replying; None for models.
        reply_ids: ids of the reply's tokens; empty unless the model was asked for margins.
        margins: how much likelier the likeliest token was than the second, at each of these and at
            the one that ends the reply, in nats; empty likewise.
        kept: what was kept of the model's cache; None if it was not cut.
    """

    question: str
    question_type: str
    n_clues: Count
    clue_column: str
    answers: Annotated[_Answers, Meta(min_length=1)]
    file: str = ""
    moment: Count | None = None
    blind: BlindGuess | None = None
    shown_clues: ShownClues | None = None
    twin: TwinSide | None = None
    recall: NiehRecall | None = None
    reply: str | None = None
    scores: dict[str, Number] = msgspec.field(default_factory=dict)
    thinking: str | None = None
    n_watched: Count | None = None
    reply_ids: tuple[Count, ...] = ()
    margins: tuple[Amount, ...] = ()
    kept: KeptCache | None = None

    @classmethod
    def of(
        cls,
        question: Question,
        blind: BlindGuess | None = None,
        shown_clues: ShownClues | None = None,
        twin: TwinSide | None = None,
    ) -> "NiehAnswer":
        """Return the payload of a question before it is asked."""
        return cls(
            question=question.text,
            question_type=question.question_type or type_of(question.text),
            n_clues=question.n_clues,
            clue_column=question.clue_column,
            answers=question.answers,
            file=question.file,
            moment=question.moment,
            blind=blind,
            shown_clues=shown_clues,
            twin=twin,
        )

    def with_reply(
        self, reply: str, scores: dict[str, float], thinking: str | None = None
    ) -> "NiehAnswer":
        """Return the same question with a reply, and what a model thought before it."""
        return msgspec.structs.replace(self, reply=reply, scores=scores, thinking=thinking)


class NiehNote(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", tag="nieh_note"):
    """A text that a model wrote for its memory, on some frames of a trajectory.

    The tokens of the request and of the note are None if the model does not count them.
    """

    note: str
    n_frames: Count
    n_context_tokens: Count | None
    n_reply_tokens: Count | None
    seconds: Amount


class NiehVerdict(msgspec.Struct, frozen=True, kw_only=True, tag_field="type", tag="nieh_verdict"):
    """A judge's verdict on a reply (`infthor_eval.nieh.rescoring.judging`).

    Attributes:
        question: the question's text.
        answers: the gold answers.
        reply: the part of the reply that counts.
        said: the judge's own words.
        score: what they say, 0 to 1: 1 for a yes, 0 for a no, None for neither.
        judge: the judge's identity as JSON values.
        seconds: duration of the request.
    """

    question: str
    answers: _Answers
    reply: str
    said: str
    score: Share | None
    judge: dict[str, Any]
    seconds: Amount


RECORDS: RecordTypes[NiehAnswer] = RecordTypes(
    unit=NiehAnswer, artifact=NiehNote | NiehRecall | NiehVerdict, config=NiehConfig
)
