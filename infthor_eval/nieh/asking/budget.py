"""Tokens of a task's requests against the model's limit, counted before the first request."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from infthor_eval.errors import DataError, ModelError
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.task import PreparedTask
from model_adapters import Model, Part


@dataclass(frozen=True)
class Budget:
    """Tokens of one task's requests against the model's limit.

    Attributes:
        longest: tokens of its longest request, with room for the reply.
        limit: the model's limit; None if it has none.
        limit_before: the limit without a RoPE extension; None if nothing is extended.
        n_contexts: number of different contexts.
        n_truncated: number of contexts without some frames of their trajectory, to keep their size.
        n_extended: number of contexts that fit only with the extension.
        n_refused: number of contexts beyond the limit; their questions will be recorded as failed.
    """

    longest: int
    limit: int | None
    limit_before: int | None
    n_contexts: int
    n_truncated: int
    n_extended: int
    n_refused: int

    @property
    def description(self) -> str:
        """The budget and its consequences in words."""
        limit = "no limit" if self.limit is None else f"limit {self.limit:,}"
        limit += (
            "" if self.limit_before is None else f", {self.limit_before:,} before its extension"
        )
        return (
            f"{self.n_contexts} contexts, the longest request {self.longest:,} tokens ({limit}): "
            f"{self._outcome}"
        )

    @property
    def _outcome(self) -> str:
        counted = [
            (self.n_truncated, "truncated: frames cut off to keep the context's size"),
            (self.n_extended, "extended: longer than the model takes without rope"),
            (self.n_refused, "refused: longer than the model takes"),
        ]
        return (
            "; ".join(f"{n} of {self.n_contexts} contexts {what}" for n, what in counted if n)
            or "fits"
        )


def budget_of(prepared: PreparedTask, model: Model) -> Budget:
    """Count the tokens of a task's requests as the model's own processor does.

    Questions in one context differ by a few words, so each context is counted once, with its
    longest question.
    """
    capabilities = model.capabilities
    limit = capabilities.max_tokens
    before = capabilities.max_tokens_before_extension
    longest = _longest_questions(prepared.task_samples.samples)
    counts = _counts(model, prepared, longest)
    fitting = [count for count in counts if limit is None or count <= limit]
    return Budget(
        longest=max(counts, default=0),
        limit=limit,
        limit_before=before,
        n_contexts=len(counts),
        n_truncated=sum(sample.n_cut > 0 for sample in longest),
        n_extended=sum(before is not None and count > before for count in fitting),
        n_refused=len(counts) - len(fitting),
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
