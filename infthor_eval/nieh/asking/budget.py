"""Tokens of a task's requests against the model's limit, counted before the first request."""

from collections.abc import Iterable, Sequence

from infthor_eval.errors import DataError, ModelError
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.task import PreparedTask
from model_adapters import Model, Part


def describe_budget(prepared: PreparedTask, model: Model) -> str:
    """Return in words what a task's requests have in tokens, and how that fits the model's limit.

    They are counted as the model's own processor does, with room for the reply. Questions in one
    context differ by a few words, so each context is counted once, with its longest question.
    """
    limit = model.capabilities.max_tokens
    before = model.capabilities.max_tokens_before_extension
    longest = _longest_questions(prepared.task_samples.samples)
    counts = _counts(model, prepared, longest)
    fitting = [count for count in counts if limit is None or count <= limit]
    n_truncated = sum(sample.n_cut > 0 for sample in longest)
    n_extended = sum(before is not None and count > before for count in fitting)
    counted = [
        (n_truncated, "truncated: frames cut off to keep the context's size"),
        (n_extended, "extended: longer than the model takes without rope"),
        # Their questions will be recorded as failed.
        (len(counts) - len(fitting), "refused: longer than the model takes"),
    ]
    outcome = "; ".join(f"{n} of {len(counts)} contexts {what}" for n, what in counted if n)
    of_model = "no limit" if limit is None else f"limit {limit:,}"
    if before is not None:
        of_model += f", {before:,} before its extension"
    return (
        f"{len(counts)} contexts, the longest request {max(counts, default=0):,} tokens "
        f"({of_model}): {outcome or 'fits'}"
    )


def _longest_questions(samples: Iterable[QuestionVariant]) -> list[QuestionVariant]:
    """Return one sample per context: that of its longest question."""
    longest: dict[tuple[str, tuple[int, ...]], QuestionVariant] = {}
    for sample in samples:
        key = sample.question.traj_id, sample.frames
        if key not in longest or len(sample.question.text) > len(longest[key].question.text):
            longest[key] = sample
    return list(longest.values())


def _counts(model: Model, prepared: PreparedTask, samples: Sequence[QuestionVariant]) -> list[int]:
    counts: list[int] = []
    refusals: list[ModelError] = []
    for sample in samples:
        context, text = prepared.task_samples.request(sample)
        context = context if model.capabilities.video_input else as_images(context)
        try:
            counts.append(_tokens(model, [*context, text]) + prepared.decoding.max_new_tokens)
        except (
            ModelError
        ) as error:  # one question's text may be the reason; the run records it as failed
            refusals.append(error)
    if refusals and not counts:
        raise refusals[0]
    return counts + [0] * len(refusals)


def _tokens(model: Model, parts: Sequence[Part]) -> int:
    conversation = model.conversation()
    conversation.append(*parts)
    try:
        return conversation.n_tokens or 0
    except DataError:  # the run records questions on an unreadable frame as failed
        return 0
