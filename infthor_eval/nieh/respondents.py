"""Who answers the questions of a run: a model through its conversation, or a baseline from the answer key."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.answering import Answerer, BaselineAnswerer, ModelAnswerer
from infthor_eval.nieh.baselines import Baseline, Predict
from infthor_eval.nieh.budget import budget_of
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.runs import Session
from model_adapters import Model, Subject

__all__ = ["Respondent", "respondent"]

# Baselines read no frames; contexts that are measured in tokens are cut for them as for Qwen2.5-VL (published count).
_BASELINE_TOKENS_PER_FRAME = 121


class Respondent(Protocol):
    """What NIEH wants of a subject."""

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """The size of a frame in contexts that are measured in tokens.

        Raises:
            UsageError: the subject counts no tokens.
        """
        ...

    def read_keys(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> None:
        """How to find all that each task asks, with the answers; once, before the first question."""
        ...

    def cost(self, prepared: PreparedTask) -> str | None:
        """What a task costs, in words; None where that is not known."""
        ...

    def answerer(self, task: str, session: Session) -> Answerer:
        """Who answers the questions of one task on one trajectory."""
        ...


class _ModelRespondent:
    def __init__(self, model: Model) -> None:
        self._model = model

    def tokens_per_frame(self, frame: FrameRef) -> int:
        tokens = self._model.tokens_per_frame(frame)
        if tokens is None:
            raise UsageError(
                f"the context has a size in tokens, which {self._model.name} does not count; give --tokens-per-frame"
            )
        return tokens

    def read_keys(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> None:
        """A model learns nothing beforehand."""

    def cost(self, prepared: PreparedTask) -> str | None:
        return budget_of(prepared, self._model).description if self._model.capabilities.counts_tokens else None

    def answerer(self, task: str, session: Session) -> Answerer:
        return ModelAnswerer(self._model, session)


class _BaselineRespondent:
    def __init__(self, baseline: Baseline) -> None:
        self._baseline = baseline
        self._predictions: dict[str, Predict] = {}

    def tokens_per_frame(self, frame: FrameRef) -> int:
        return _BASELINE_TOKENS_PER_FRAME

    def read_keys(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> None:
        """Fitted to each task apart: what one task asks is no clue to another."""
        self._predictions = {task: self._baseline.fit(find()) for task, find in keys.items()}

    def cost(self, prepared: PreparedTask) -> str | None:
        return None

    def answerer(self, task: str, session: Session) -> Answerer:
        return BaselineAnswerer(self._predictions[task])


def respondent(subject: Subject) -> Respondent:
    """The respondent that a subject makes.

    Raises:
        TypeError: it is neither a model nor a baseline; the run sees to that before.
    """
    if isinstance(subject, Baseline):
        return _BaselineRespondent(subject)
    if isinstance(subject, Model):
        return _ModelRespondent(subject)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of NIEH")
