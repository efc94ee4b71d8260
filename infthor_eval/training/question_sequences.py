"""Training sequences for answering: NIEH questions as evaluated, with reference answers."""

from collections.abc import Iterator

from infthor_eval.errors import DataError, UsageError
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence, within


def question_sequences(
    encoder: Encoder, task: TaskSamples, limit: int
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Yield a sequence for each sample of a task in a context, or a skipped item if unusable.

    Args:
        encoder: builds the sequences.
        task: the samples.
        limit: most tokens of a sequence, frames expanded; longer ones are skipped.

    Raises:
        UsageError: the context needs a memory.
        ModelError: the template refuses the turns.
    """
    for skipped in task.skipped:
        yield SkippedSequence(_name(skipped.question.id, skipped.variant), skipped.reason)
    for sample in task.samples:
        name = _name(sample.question.id, sample.variant)
        try:
            sequence = _sequence(encoder, task, sample, name)
        except DataError as error:
            yield SkippedSequence(name, str(error))
            continue
        yield within(sequence, limit)


def _sequence(encoder: Encoder, task: TaskSamples, sample: Sample, name: str) -> TrainingSequence:
    context, text = task.request(sample)
    if sample.awaits_recall:
        raise UsageError("training has no memory; use another context")
    # It has no video input.
    return encoder.answer(name, [*as_images(context), text], doc_target(sample.question))


def _name(question: str, variant: str) -> str:
    return f"{question} {variant}".rstrip()
