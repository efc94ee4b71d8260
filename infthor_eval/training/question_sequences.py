"""What a model learns answering from: NIEH questions as they are asked, each with the answer of its key."""

from collections.abc import Iterator

from infthor_eval.errors import DataError, UsageError
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.notes import Notes
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.training.encoding import Encoder, SkippedItem, TrainingSequence

__all__ = ["question_sequences"]


def question_sequences(encoder: Encoder, asked: TaskSamples, limit: int) -> Iterator[TrainingSequence | SkippedItem]:
    """Sequences of a set's questions.

    Args:
        encoder: makes the sequences.
        asked: all that a task in one context asks.
        limit: tokens of a sequence, frames expanded.

    Yields:
        A sequence for each sample, and what cannot be asked or is too long.

    Raises:
        UsageError: the context wants a model's notes.
        ModelError: the template refuses the turns.
    """
    for skipped in asked.skipped:
        yield SkippedItem(_name(skipped.question.id, skipped.variant), skipped.reason)
    for sample in asked.samples:
        name = _name(sample.question.id, sample.variant)
        try:
            sequence = _sequence(encoder, asked, sample, name)
        except DataError as error:
            yield SkippedItem(name, str(error))
            continue
        too_long = sequence.n_tokens > limit
        yield SkippedItem(name, f"longer than {limit} tokens") if too_long else sequence


def _sequence(encoder: Encoder, asked: TaskSamples, sample: Sample, name: str) -> TrainingSequence:
    shown, text = asked.request(sample)
    known = [part for part in shown if not isinstance(part, Notes)]
    if len(known) < len(shown):
        raise UsageError("a model that is being trained has no notes yet; train on another context")
    return encoder.answer(name, [*known, text], doc_target(sample.question))


def _name(question: str, variant: str) -> str:
    return f"{question} {variant}".rstrip()
