"""Having questions of NIEH answered, by a model's conversations or by a baseline.

What a memory recalls comes first, then each request in its place. How a request is answered is in
`infthor_eval.questions.asking`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from msgspec.structs import replace as replace_fields

from infthor_eval.errors import DataError, ModelError, UsageError, UserCodeError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Answer
from infthor_eval.memory import Write
from infthor_eval.nieh.asking.baselines import Baseline, Blind, Predict
from infthor_eval.nieh.asking.budget import describe_budget
from infthor_eval.nieh.asking.notebook import Notebook
from infthor_eval.nieh.asking.recalling import Recaller, apply_recall
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.records import NiehAnswer, NiehRecall
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.nieh.twins import first_world, twin_side
from infthor_eval.nieh.units import NiehUnit, shown_clues
from infthor_eval.questions.asking import (
    BaselineReplier,
    ModelReplier,
    Replier,
    Request,
    answer_requests,
    is_asked,
)
from infthor_eval.runs import Session, StoredRequest, UnitRecord
from model_adapters import Model, Reply, Subject

# Baselines read no frames; contexts that are measured in tokens are cut for them as for Qwen2.5-VL
# (published count).
_BASELINE_TOKENS_PER_FRAME = 121
_MARGIN_DIGITS = 3  # after the point, of margins in nats


@dataclass(frozen=True, kw_only=True)
class NiehRequest(Request[NiehAnswer]):
    """The request of a question of NIEH; `prepared` is its task."""

    unit: NiehUnit
    prepared: PreparedTask

    @classmethod
    def of(cls, unit: NiehUnit, prepared: PreparedTask, video_input: bool | None) -> "NiehRequest":
        """Return the request of a unit; films are images for a model without a video input."""
        context, text = prepared.task_samples.request(unit.sample)
        decoding = prepared.decoding
        return cls(
            unit=unit,
            prepared=prepared,
            context=tuple(as_images(context) if video_input is False else context),
            text=text,
            answers=unit.payload.answers,
            decoding=replace(
                decoding, seed=decoding.seed + unit.key.repeat - 1, cache=unit.sample.cut
            ),
            stop=prepared.stop,
        )

    @property
    def words(self) -> tuple[str, ...]:
        """See `Request`: those of the set."""
        return self.prepared.task_samples.words

    @property
    def stored(self) -> StoredRequest | None:
        """See `Request`; for baselines no memory recalls anything."""
        sample = self.unit.sample
        if sample.awaits_recall:
            return None
        return self.prepared.task_samples.stored_request(sample, self.context, self.text)

    def replied(self, reply: Reply, answer: str, thinking: str | None) -> NiehAnswer:
        """See `Request`."""
        payload = self.unit.payload.with_reply(answer, {}, thinking)
        payload = replace_fields(payload, n_watched=reply.n_watched, kept=reply.kept)
        if reply.margins is None:
            return payload
        margins = tuple(round(margin, _MARGIN_DIGITS) for margin in reply.margins)
        return replace_fields(payload, reply_ids=reply.token_ids or (), margins=margins)

    def scored(self, payload: NiehAnswer, answer: str) -> NiehAnswer:
        """See `Request`; of a twin, also by the answers of the other world."""
        twin = payload.twin
        scores = self._scores(answer, payload.answers)
        if twin is not None and self.prepared.metrics.process is not None:
            twin = replace_fields(twin, scores=self._scores(answer, twin.answers))
        return replace_fields(payload, scores=scores, twin=twin)

    def _scores(self, answer: str, answers: Sequence[Answer]) -> dict[str, float]:
        """Return what an answer scores against gold answers, those of the other world included."""
        sample = self.unit.sample
        asked = replace(sample, question=replace(sample.question, answers=tuple(answers)))
        return self.prepared.metrics.scores(self.prepared.task_samples, asked, answer)


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
            lines.append(describe_budget(prepared, self._model))
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


def answer_units(
    units: Sequence[NiehUnit],
    prepared: PreparedTask,
    answerer: Answerer,
    session: Session[NiehAnswer],
) -> Iterator[UnitRecord[NiehAnswer]]:
    """Yield the records of units on one trajectory, or on twins of one.

    Those with one context are answered together. Neighbours share as long a prefix as there is,
    which a model's conversation encodes once; so do the repetitions of a question. Of two worlds
    the one that is drawn comes first, so that their order tells nothing.

    Args:
        units: the units, all of one task.
        prepared: the task.
        answerer: what answers, fitted to the task's answer key.
        session: the run's results so far.
    """
    requests = []
    replier = answerer.open(units[0].key.task)
    write = answerer.open_notebook(session)
    for unit, recalled in _recall_all(units, prepared, write, session):
        try:
            if isinstance(recalled, Exception):
                raise recalled
            requests.append(NiehRequest.of(recalled, prepared, answerer.video_input))
        except (DataError, ModelError, UserCodeError) as error:
            yield unit.record_failure(session.describe_failure(unit, error), asked=is_asked(error))
    yield from answer_requests(_in_order(requests), replier, session)


def _in_order(requests: Sequence[NiehRequest]) -> list[NiehRequest]:
    """Return requests by their contexts; of a pair, the other world's after the first one's.

    Moments of one world follow each other, as each of their contexts begins the next one.
    """
    worlds: dict[tuple[str, str, int], dict[str, list[str]]] = {}
    longest: dict[str, list[str]] = {}
    for request in requests:
        worlds.setdefault(_pair(request), {})[_world(request)] = request.names
        longest[_world(request)] = max(longest.get(_world(request), []), request.names, key=len)

    def place(request: NiehRequest) -> tuple[list[str], bool, list[str]]:
        names = worlds[_pair(request)]
        first = first_world(names)
        at_end = request.unit.sample.question.moment is None
        shown = names[first] if at_end else longest[first]
        return shown, _world(request) != first, names[_world(request)]

    return sorted(requests, key=place)


def _pair(request: NiehRequest) -> tuple[str, str, int]:
    """Return what the questions of a pair have in common; of another question what tells it."""
    key = request.unit.key
    return request.unit.sample.question.pair or key.id, key.variant, key.repeat


def _world(request: NiehRequest) -> str:
    return request.unit.sample.question.traj_id


def _recall_all(
    units: Sequence[NiehUnit],
    prepared: PreparedTask,
    write: Write | None,
    session: Session[NiehAnswer],
) -> list[tuple[NiehUnit, NiehUnit | Exception]]:
    """Return each unit with what its memory recalled, or why that failed; or as it is."""
    if write is None or not any(unit.sample.awaits_recall for unit in units):
        return [(unit, unit) for unit in units]
    recaller = Recaller(
        prepared.task_samples,
        write,
        find=lambda inputs: session.find_artifact(inputs, NiehRecall),
        keep=session.cache_artifact,
    )
    with recaller.in_use():
        return [(unit, _recall(unit, recaller, prepared)) for unit in units]


def _recall(unit: NiehUnit, recaller: Recaller, prepared: PreparedTask) -> NiehUnit | Exception:
    try:
        recall = recaller.recall(unit.sample)
    except (DataError, ModelError, UserCodeError) as error:
        return error
    samples = prepared.task_samples
    question = unit.sample.question
    clues = samples.data.clue_positions(question) if question.has_evidence else ()
    sample = apply_recall(unit.sample, recall, tuple(sorted(set(clues))))
    seen = sample
    if sample.cut is not None:  # of a cache what is left of the frames
        seen = replace(sample, frames=(*(sample.cut.frames or ()), sample.frames[-1]))
    chooses_tokens = sample.cut is not None and sample.cut.frames is None
    payload = replace_fields(
        unit.payload,
        recall=recall,
        shown_clues=None if chooses_tokens else shown_clues(samples, seen),
        twin=twin_side(samples, seen),
    )
    return replace(unit, sample=sample, payload=payload)
