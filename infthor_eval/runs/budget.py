"""What the requests of a run cost in tokens, told before the first of them is computed."""

from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.contexts import Case, context_named
from infthor_eval.nieh.prompts import question_text
from infthor_eval.nieh.work import Work
from model_adapters import Model, Part

__all__ = ["Budget", "budget_of"]


@dataclass(frozen=True)
class Budget:
    """Tokens of one task's requests against the model's limit.

    Attributes:
        task: the lm-eval task.
        longest: tokens of its longest request, room for the reply included.
        limit: the model's limit, None where it has none.
        n_contexts: different contexts that the task asks in.
        n_refused: how many of them are beyond the limit; their questions will be recorded as failed.
    """

    task: str
    longest: int
    limit: int | None
    n_contexts: int
    n_refused: int

    @property
    def outcome(self) -> str:
        """What will happen, in words."""
        if self.limit is None or self.n_refused == 0:
            return "fits"
        return f"{self.n_refused} of {self.n_contexts} contexts refused: longer than the model takes"


def budget_of(task: str, context: str, work: Work, model: Model, max_new_tokens: int) -> Budget:
    """Count the tokens of a task's requests as the model's own processor does.

    Questions in one context differ by a few words, so each context is counted once, with its longest question.

    Args:
        task: the lm-eval task.
        context: the name of its context.
        work: what it asks.
        model: whose tokens.
        max_new_tokens: room for the reply.
    """
    counts = [_tokens(model, parts) + max_new_tokens for parts in _requests(context, work)]
    limit = model.max_tokens
    refused = sum(count > limit for count in counts) if limit is not None else 0
    return Budget(task, max(counts, default=0), limit, len(counts), refused)


def _requests(context: str, work: Work) -> list[list[Part]]:
    """One request per context: that of its longest question."""
    longest: dict[tuple[str, tuple[int, ...]], tuple[int, list[Part]]] = {}
    chosen = context_named(context)
    for question, case in work.cases:
        key = (question.traj_id, case.frames)
        if key not in longest or len(question.text) > longest[key][0]:
            shown = chosen.parts(work.data, question, _frames(work, question.traj_id, case))
            longest[key] = (len(question.text), [*shown, question_text(chosen.intro, question)])
    return [parts for _, parts in longest.values()]


def _frames(work: Work, traj_id: str, case: Case) -> Sequence[FrameRef]:
    frames = work.data.frames(traj_id)
    return [frames[position] for position in case.frames]


def _tokens(model: Model, parts: Sequence[Part]) -> int:
    conversation = model.conversation()
    conversation.append(*parts)
    try:
        return conversation.n_tokens
    except DataError:  # a frame that cannot be read costs nothing; the run records its questions as failed
        return 0
