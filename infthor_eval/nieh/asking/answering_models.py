"""What answers the questions of a run: a model through its conversation, or a baseline from the
answer key."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.nieh.asking.answering import Answerer, BaselineAnswerer, ModelAnswerer
from infthor_eval.nieh.asking.baselines import Baseline
from infthor_eval.nieh.asking.budget import budget_of
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.runs import Session
from model_adapters import Model, Subject

__all__ = ["AnsweringModel", "OpenAnswerer", "answering_model"]

# Opens what answers the questions of one task on one trajectory, given the task's name.
OpenAnswerer = Callable[[str, Session[NiehAnswer]], Answerer]

# Baselines read no frames; contexts that are measured in tokens are cut for them as for Qwen2.5-VL
# (published count).
_BASELINE_TOKENS_PER_FRAME = 121


class AnsweringModel(Protocol):
    """A subject that answers questions: a model or a baseline.

    Attributes:
        video_input: True if it is given films as videos, False if as images; None if it sees
            nothing.
    """

    video_input: bool | None

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """Return the size of a frame in contexts that are measured in tokens.

        Raises:
            UsageError: the subject counts no tokens.
        """

    def cost(self, prepared: PreparedTask) -> str | None:
        """Return the cost of a task in words, or None where it is not known."""

    def fit(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> OpenAnswerer:
        """Fit the subject to the answer key of each task, given a function that finds the key;
        models need no key."""


class _ConversationModel:
    def __init__(self, model: Model) -> None:
        self._model = model
        self.video_input: bool | None = model.capabilities.video_input

    def tokens_per_frame(self, frame: FrameRef) -> int:
        tokens = self._model.tokens_per_frame(frame)
        if tokens is None:
            raise UsageError(
                f"the context has a size in tokens, which {self._model.name} does not count; give "
                "--tokens-per-frame"
            )
        return tokens

    def cost(self, prepared: PreparedTask) -> str | None:
        lines = (
            [budget_of(prepared, self._model).description]
            if self._model.capabilities.counts_tokens
            else []
        )
        if any(sample.awaits_recall for sample in prepared.task_samples.samples):
            lines.append("what a memory recalls for each question is not counted yet")
        if prepared.task_samples.shows_films:
            name = self._model.name
            as_video = "the film is given as a video"
            lines.append(
                as_video
                if self.video_input
                else f"{name} has no video input, the film is given as images"
            )
        return "; ".join(lines) or None

    def fit(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> OpenAnswerer:
        return lambda _, session: ModelAnswerer(self._model, session)


class _BaselineModel:
    video_input: bool | None = None

    def __init__(self, baseline: Baseline) -> None:
        self._baseline = baseline

    def tokens_per_frame(self, frame: FrameRef) -> int:
        return _BASELINE_TOKENS_PER_FRAME

    def cost(self, prepared: PreparedTask) -> str | None:
        return None

    def fit(self, keys: Mapping[str, Callable[[], Sequence[Sample]]]) -> OpenAnswerer:
        # Each task on its own: the questions of one task must be no clue to another.
        predictions = {task: self._baseline.fit(find_key()) for task, find_key in keys.items()}
        return lambda task, _: BaselineAnswerer(predictions[task])


def answering_model(subject: Subject) -> AnsweringModel:
    """Return the answering model of a subject.

    Raises:
        TypeError: the subject is neither a model nor a baseline; runs refuse it before.
    """
    if isinstance(subject, Baseline):
        return _BaselineModel(subject)
    if isinstance(subject, Model):
        return _ConversationModel(subject)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of NIEH")
