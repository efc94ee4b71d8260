"""What answers the questions of a run: a model by its conversations, or a baseline."""

from collections.abc import Mapping
from typing import Protocol

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.memory import Write
from infthor_eval.nieh.asking.answering import NiehRequest
from infthor_eval.nieh.asking.baselines import Baseline, Blind, Predict
from infthor_eval.nieh.asking.budget import budget_of
from infthor_eval.nieh.asking.notebook import Notebook
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.questions.asking import BaselineReplier, ModelReplier, Replier
from infthor_eval.runs import Session
from model_adapters import Model, Subject

# Baselines read no frames; contexts that are measured in tokens are cut for them as for Qwen2.5-VL
# (published count).
_BASELINE_TOKENS_PER_FRAME = 121


class Answerer(Protocol):
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

    def fit(self, tasks: Mapping[str, TaskSamples]) -> None:
        """Fit the subject to the answer key of each task's set; models need no key."""

    def open(self, task: str) -> Replier:
        """Return what answers the questions of a task on one trajectory."""

    def open_notebook(self, session: Session[NiehAnswer]) -> Write | None:
        """Return what asks the model for texts for its memory; None for who reads no context."""


class _ModelAnswerer:
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
        lines = []
        if self._model.capabilities.counts_tokens:
            lines.append(budget_of(prepared, self._model).description)
        if any(sample.awaits_recall for sample in prepared.task_samples.samples):
            lines.append("what a memory recalls for each question is not counted yet")
        if prepared.task_samples.shows_films:
            lines.append(
                "the film is given as a video"
                if self.video_input
                else f"{self._model.name} has no video input, the film is given as images"
            )
        return "; ".join(lines) or None

    def fit(self, tasks: Mapping[str, TaskSamples]) -> None:
        pass

    def open(self, task: str) -> Replier:
        return ModelReplier(self._model)

    def open_notebook(self, session: Session[NiehAnswer]) -> Write | None:
        return Notebook(self._model, session).write


class _BaselineAnswerer:
    video_input: bool | None = None

    def __init__(self, baseline: Baseline) -> None:
        self._baseline = baseline
        self._predictions: dict[str, Predict] = {}

    def tokens_per_frame(self, frame: FrameRef) -> int:
        return _BASELINE_TOKENS_PER_FRAME

    def cost(self, prepared: PreparedTask) -> str | None:
        if not isinstance(self._baseline, Blind):
            return None
        questions = prepared.task_samples.data.questions  # all that it learns from
        if len({question.cluster for question in questions}) > 1:
            return None
        return (
            f"one trajectory: {self._baseline.name} learns from its other questions alone, which "
            "say too little to measure others by it"
        )

    def fit(self, tasks: Mapping[str, TaskSamples]) -> None:
        for name, samples in tasks.items():
            self._predictions[name] = self._baseline.fit(samples.data, samples.context_name)

    def open(self, task: str) -> Replier:
        predict = self._predictions[task]

        def reply(request: NiehRequest) -> str:
            return predict(request.unit.sample, request.context)

        return BaselineReplier(reply)

    def open_notebook(self, session: Session[NiehAnswer]) -> Write | None:
        return None


def answerer_of(subject: Subject) -> Answerer:
    """Return what answers questions for a subject.

    Raises:
        TypeError: the subject is neither a model nor a baseline; runs refuse it before.
    """
    if isinstance(subject, Baseline):
        return _BaselineAnswerer(subject)
    if isinstance(subject, Model):
        return _ModelAnswerer(subject)
    raise TypeError(f"{subject.name} is neither a model nor a baseline of NIEH")
