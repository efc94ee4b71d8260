"""What a model learns answering from: NIEH questions as they are asked, each with the answer of its key."""

from collections.abc import Iterator

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet, SkippedQuestion
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import Context, ContextSettings, context_named
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.notes import Notes
from infthor_eval.training.encoding import Encoded, Encoder, LeftOut

__all__ = ["question_sequences"]


def question_sequences(
    encoder: Encoder, data: NiehSet, context: str, settings: ContextSettings, limit: int
) -> Iterator[Encoded | LeftOut]:
    """Sequences of a set's questions.

    Args:
        encoder: makes the sequences.
        data: the set.
        context: name of the context in which they are asked.
        settings: of the context.
        limit: tokens of a sequence, frames expanded.

    Yields:
        A sequence for each sample, and what cannot be asked or is too long.

    Raises:
        UsageError: there is no such context, it wants a model's notes, or a setting that it needs is not there.
        ModelError: the template refuses the turns.
    """
    kind = context_named(context)
    for skipped in data.skipped:
        yield LeftOut(skipped.question.id, skipped.reason)
    for question in data.questions:
        try:
            yield from _of_question(encoder, data, kind, question, settings, limit)
        except DataError as error:
            yield LeftOut(question.id, str(error))


def _of_question(
    encoder: Encoder, data: NiehSet, context: Context, question: Question, settings: ContextSettings, limit: int
) -> Iterator[Encoded | LeftOut]:
    for sample in context.samples(data, question, settings):
        if isinstance(sample, SkippedQuestion):
            yield LeftOut(question.id, sample.reason)
            continue
        name = f"{question.id} {sample.variant}".rstrip()
        shown, text = context.request(data, sample)
        known = [part for part in shown if not isinstance(part, Notes)]
        if len(known) < len(shown):
            raise UsageError("a model that is being trained has no notes yet; train on another context")
        sequence = encoder.answer(name, [*known, text], doc_target(question))
        too_long = sequence.n_tokens > limit
        yield LeftOut(name, f"longer than {limit} tokens") if too_long else sequence
