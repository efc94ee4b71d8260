"""A reply that others made as a record: scored, with what is known of the frames it was given."""

from collections.abc import Mapping
from dataclasses import dataclass

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.formats.replies.logged import LoggedReply
from infthor_eval.nieh.records import BlindGuess, NiehAnswer, ShownClues
from infthor_eval.nieh.scoring import scores
from infthor_eval.nieh.twins import twin_of_reply
from infthor_eval.runs import Tokens, Unit, UnitKey, UnitRecord
from infthor_eval.storage.digests import fingerprint
from model_adapters import Reply, answer_of

WHOLE = (None, "full_traj")  # published modes that show all frames; early logs name no mode


@dataclass(frozen=True)
class Known:
    """What is known of the questions: their set, what `blind` says to them by id, and numbers of
    frames by trajectory."""

    data: NiehSet
    blind: Mapping[str, BlindGuess]
    n_frames: Mapping[str, int]

    def length(self, traj_id: str) -> int | None:
        """Return a trajectory's number of frames; None if neither a log nor the set tells."""
        if traj_id in self.n_frames or not self.data.has_frames:
            return self.n_frames.get(traj_id)
        return len(self.data.frames(traj_id))


def imported_record(
    task: str, question: Question, reply: LoggedReply, known: Known
) -> UnitRecord[NiehAnswer]:
    """Return the record of a reply, or of why there is none, as the log says it."""
    payload = NiehAnswer.of(
        question,
        known.blind.get(question.id),
        _shown_clues(question, reply, known),
        twin_of_reply(known.data, question, reply.frames),
    )
    key = UnitKey(task, question.id, reply.variant, reply.repeat)
    unit = Unit(key, question.cluster, payload)
    tokens = Tokens(context=reply.n_context_tokens, reply=reply.n_reply_tokens)
    if reply.failure is not None:
        made_of = {"question": question.id, "failure": reply.failure}
        return unit.record_failure(reply.failure, fingerprint(made_of), seconds=reply.seconds)
    thinking, answer = answer_of(Reply(reply.text, thinking=reply.thinking))
    return unit.record(
        fingerprint({"question": question.id, "reply": reply.text}),
        payload.with_reply(answer, scores(answer, question.answers), thinking),
        seconds=reply.seconds,
        tokens=tokens,
    )


def _shown_clues(question: Question, reply: LoggedReply, known: Known) -> ShownClues | None:
    """Return the clue frames shown; None if the row does not tell, or if no frame is evidence."""
    clues = set(question.clues)
    is_whole = reply.published is not None and reply.mode in WHOLE
    if question.absence or (reply.frames is None and not is_whole):
        return None
    n_frames = known.length(question.traj_id)
    n_shown = len(clues if reply.frames is None else clues.intersection(reply.frames))
    # A log of a model that takes only some frames counts these alone, and a clue can lie beyond.
    n_after = None if n_frames is None or n_frames <= max(clues) else n_frames - 1 - max(clues)
    return ShownClues(n_shown=n_shown, n_clues=len(clues), n_after=n_after)
