"""What the requests of a run cost in tokens, told before the first of them is computed."""

from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.contexts import Part, context_named
from infthor_eval.nieh.notes import Notes
from infthor_eval.nieh.work import Work
from model_adapters import ExtendableModel, Model

__all__ = ["Budget", "budget_of"]


@dataclass(frozen=True)
class Budget:
    """Tokens of one task's requests against the model's limit.

    Attributes:
        task: the lm-eval task.
        longest: tokens of its longest request, room for the reply included.
        limit: the model's limit, None where it has none.
        limit_before: the limit that a RoPE extension raised to this one, None where nothing is extended.
        n_contexts: different contexts that the task asks in.
        n_truncated: how many of them leave out frames of their trajectory to keep their size.
        n_extended: how many fit because of the extension alone.
        n_refused: how many are beyond the limit; their questions will be recorded as failed.
    """

    task: str
    longest: int
    limit: int | None
    limit_before: int | None
    n_contexts: int
    n_truncated: int
    n_extended: int
    n_refused: int

    @property
    def outcome(self) -> str:
        """What will happen, in words."""
        counted = [
            (self.n_truncated, "truncated: frames cut off to keep the context's size"),
            (self.n_extended, "extended: longer than the model takes without rope"),
            (self.n_refused, "refused: longer than the model takes"),
        ]
        return "; ".join(f"{n} of {self.n_contexts} contexts {what}" for n, what in counted if n) or "fits"


def budget_of(task: str, context: str, work: Work, model: Model, max_new_tokens: int) -> Budget:
    """Count the tokens of a task's requests as the model's own processor does.

    Questions in one context differ by a few words, so each context is counted once, with its longest question.

    Args:
        task: the lm-eval task.
        context: the name of its context.
        work: what it asks.
        model: whose tokens.
        max_new_tokens: room for the reply.

    Raises:
        ModelError: the model can take none of the requests, whatever their length.
    """
    counts = _counts(model, _requests(context, work), max_new_tokens)
    limit, before = model.max_tokens, _limit_before(model)
    fitting = [count for count in counts if limit is None or count <= limit]
    return Budget(
        task=task,
        longest=max(counts, default=0),
        limit=limit,
        limit_before=before,
        n_contexts=len(counts),
        n_truncated=len({(question.traj_id, case.frames) for question, case in work.cases if case.n_cut}),
        n_extended=sum(before is not None and count > before for count in fitting),
        n_refused=len(counts) - len(fitting),
    )


def _counts(model: Model, requests: Sequence[Sequence[Part]], max_new_tokens: int) -> list[int]:
    counts: list[int] = []
    refusals: list[ModelError] = []
    for parts in requests:
        try:
            counts.append(_most_tokens(model, parts, max_new_tokens))
        except ModelError as error:  # one question's text may be to blame; the run records it as failed
            refusals.append(error)
    if refusals and not counts:
        raise refusals[0]
    return counts + [0] * len(refusals)


def _limit_before(model: Model) -> int | None:
    return model.max_tokens_before_extension if isinstance(model, ExtendableModel) else None


def _requests(context: str, work: Work) -> list[list[Part]]:
    """One request per context: that of its longest question."""
    longest: dict[tuple[str, tuple[int, ...]], tuple[int, list[Part]]] = {}
    chosen = context_named(context)
    for question, case in work.cases:
        key = (question.traj_id, case.frames)
        if key not in longest or len(question.text) > longest[key][0]:
            longest[key] = (len(question.text), chosen.request(work.data, question, case))
    return [parts for _, parts in longest.values()]


def _most_tokens(model: Model, parts: Sequence[Part], max_new_tokens: int) -> int:
    """Tokens of a request and its reply, or of the longest one for a note that is shown in it, if that is longer.

    Notes are not written yet; each is counted with all the tokens that it may have.
    """
    notes = [part for part in parts if isinstance(part, Notes)]
    empty = [part.text([""] * len(part.windows)) if isinstance(part, Notes) else part for part in parts]
    room = sum(len(item.windows) * item.taking.max_new_tokens for item in notes)
    reading = [_tokens(model, window.request) + item.taking.max_new_tokens for item in notes for window in item.windows]
    return max([_tokens(model, empty) + room + max_new_tokens, *reading])


def _tokens(model: Model, parts: Sequence[str | FrameRef]) -> int:
    conversation = model.conversation()
    conversation.append(*parts)
    try:
        return conversation.n_tokens
    except DataError:  # a frame that cannot be read costs nothing; the run records its questions as failed
        return 0
