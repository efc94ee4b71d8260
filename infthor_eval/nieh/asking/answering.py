"""Having questions answered: by a model's conversation, or by a baseline from the answer key.

This is the one way from a sample to its record, whoever drives it: our own run, or lm-eval as the
host.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import Any, Protocol

from msgspec.structs import replace as replace_fields

from infthor_eval.errors import DataError, ModelError, NotAskedError, UserCodeError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.question import Answer
from infthor_eval.memory import Write
from infthor_eval.nieh.asking.baselines import Predict
from infthor_eval.nieh.asking.notebook import Notebook
from infthor_eval.nieh.asking.recalling import Recaller, apply_recall
from infthor_eval.nieh.contexts import ContextPart
from infthor_eval.nieh.contexts.video import as_images
from infthor_eval.nieh.metrics import MetricError
from infthor_eval.nieh.records import NiehAnswer, NiehRecall
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.nieh.twins import first_world, twin_side
from infthor_eval.nieh.units import NiehUnit, shown_clues
from infthor_eval.runs import NOTHING, ReadHashes, Session, Tokens, UnitRecord, Usage
from infthor_eval.storage.digests import fingerprint
from model_adapters import (
    Attended,
    Decoding,
    Model,
    Notice,
    Part,
    Reply,
    answer_of,
    wrap_request_errors,
)

_MARGIN_DIGITS = 3  # after the point, of margins in nats


@dataclass(frozen=True)
class _UnitRequest:
    """A unit with its request: the context, and the text with the question."""

    unit: NiehUnit
    prepared: PreparedTask
    context: tuple[Part, ...]
    text: str

    @classmethod
    def of(cls, unit: NiehUnit, prepared: PreparedTask, answerer: "OpenAnswerer") -> "_UnitRequest":
        context, text = prepared.task_samples.request(unit.sample)
        return cls(unit, prepared, answerer.read(context), text)

    @cached_property
    def fingerprint(self) -> str:
        """See `request_fingerprint`."""
        return request_fingerprint(
            self.context, self.text, self.unit.payload.answers, self.decoding.document()
        )

    @property
    def decoding(self) -> Decoding:
        """The task's decoding, with the seed of the repetition."""
        decoding = self.prepared.decoding
        return replace(decoding, seed=decoding.seed + self.unit.key.repeat - 1)

    def record(
        self,
        reply: Reply,
        seconds: float,
        faults: tuple[str, ...],
        usage: Usage,
        session: Session[NiehAnswer],
    ) -> UnitRecord[NiehAnswer]:
        """Return the record of a reply; failed, with the reply, if the metrics fail on it."""
        scores = {}
        twin = self.unit.payload.twin
        failure = None
        thinking, answer = answer_of(reply)
        answer = self.prepared.cut(answer)
        try:
            scores = self._scores(answer, self.unit.payload.answers)
            if twin is not None and self.prepared.metrics.process is not None:
                twin = replace_fields(twin, scores=self._scores(answer, twin.answers))
        except MetricError as error:
            failure = session.describe_failure(self.unit, error)
        return self.unit.record(
            self.fingerprint,
            replace_fields(self._answered(reply, answer, scores, thinking), twin=twin),
            failure=failure,
            faults=(*faults, *reply.faults),
            seconds=round(seconds, 4),
            tokens=Tokens(reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens),
            usage=usage,
            read=ReadHashes(reply.context_hash, reply.frames_hash),
        )

    def _scores(self, answer: str, answers: Sequence[Answer]) -> dict[str, float]:
        """Return what an answer scores against gold answers, those of the other world included."""
        sample = self.unit.sample
        asked = replace(sample, question=replace(sample.question, answers=tuple(answers)))
        return self.prepared.metrics.scores(self.prepared.task_samples, asked, answer)

    def _answered(
        self, reply: Reply, answer: str, scores: dict[str, float], thinking: str | None
    ) -> NiehAnswer:
        payload = self.unit.payload.with_reply(answer, scores, thinking)
        payload = replace_fields(payload, n_watched=reply.n_watched)
        if reply.margins is None:
            return payload
        margins = tuple(round(margin, _MARGIN_DIGITS) for margin in reply.margins)
        return replace_fields(payload, reply_ids=reply.token_ids or (), margins=margins)


class OpenAnswerer(Protocol):
    """Gives the replies to the units of a task on one trajectory, or on twins of one."""

    @property
    def batch_size(self) -> int:
        """Number of units worth answering at once."""

    @property
    def batch_contexts(self) -> bool:
        """True if these may have different contexts."""

    @property
    def write(self) -> Write | None:
        """What asks the model for texts for its memory; None without one: it reads no context."""

    def read(self, context: Sequence[ContextPart]) -> tuple[Part, ...]:
        """Return a context as the model gets it: films as images, unless it has a video input."""

    def answer(self, requests: Sequence[_UnitRequest]) -> list[Reply]:
        """Return replies to units of one decoding, and of one context unless contexts are batched.

        Raises:
            DataError: a frame cannot be read; nothing is answered then.
            ModelError: the model cannot take one of the requests; nothing is answered then.
        """

    def usage(self, reply: Reply) -> Usage:
        """Return the usage of a reply."""


class OpenModel:
    """A model with one conversation: units in the same context share what is encoded of it."""

    def __init__(self, model: Model, session: Session[NiehAnswer]) -> None:
        self.batch_size = model.capabilities.batch_size
        self.batch_contexts = model.capabilities.batch_contexts
        self._name = model.name
        self._person = model if isinstance(model, Attended) else None
        self._video_input = model.capabilities.video_input
        self.write: Write | None = Notebook(model, session).write
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._after_context = self._start
        self._context: tuple[Part, ...] | None = None

    def read(self, context: Sequence[ContextPart]) -> tuple[Part, ...]:
        """See `OpenAnswerer`."""
        return tuple(context if self._video_input else as_images(context))

    def answer(self, requests: Sequence[_UnitRequest]) -> list[Reply]:
        """See `OpenAnswerer`."""
        context = requests[0].context
        decoding = requests[0].decoding
        if self._person is not None:
            self._person.tell(
                Notice(
                    title="Question",
                    unit="question",
                    words=requests[0].prepared.task_samples.words,
                )
            )
        with wrap_request_errors(self._name):
            if any(request.context != context for request in requests[1:]):
                self._go_to(())
                return self._conversation.replies(
                    [[*request.context, request.text] for request in requests], decoding
                )
            self._go_to(context)
            return self._conversation.replies([[request.text] for request in requests], decoding)

    def _go_to(self, context: tuple[Part, ...]) -> None:
        """Let the conversation be this context."""
        if context != self._context:
            self._conversation.rewind(self._start)
            self._context = None
            self._conversation.append(*context)
            self._context, self._after_context = context, self._conversation.mark()
        self._conversation.rewind(self._after_context)

    def usage(self, reply: Reply) -> Usage:
        """See `OpenAnswerer`."""
        return Usage.of([reply])


class OpenBaseline:
    """A baseline, which has no memory."""

    batch_size = 1
    batch_contexts = False
    write = None

    def __init__(self, predict: Predict) -> None:
        self._predict = predict

    def read(self, context: Sequence[ContextPart]) -> tuple[Part, ...]:
        """See `OpenAnswerer`."""
        return tuple(context)

    def answer(self, requests: Sequence[_UnitRequest]) -> list[Reply]:
        """See `OpenAnswerer`."""
        return [Reply(self._predict(request.unit.sample, request.context)) for request in requests]

    def usage(self, reply: Reply) -> Usage:
        """See `OpenAnswerer`."""
        return NOTHING


def answer_units(
    units: Sequence[NiehUnit],
    prepared: PreparedTask,
    answerer: OpenAnswerer,
    session: Session[NiehAnswer],
) -> Iterator[UnitRecord[NiehAnswer]]:
    """Yield the records of units on one trajectory, or on twins of one.

    Those with one context are answered together, and all of them if the answerer batches contexts.
    Neighbours share as long a prefix as there is, which a model's conversation encodes once; so do
    the repetitions of a question. Of two worlds the one that is drawn comes first, so that their
    order tells nothing. The order depends on the units alone, so it is the same when a run is
    resumed.
    """
    requests = []
    for unit, recalled in _recall_all(units, prepared, answerer, session):
        try:
            if isinstance(recalled, Exception):
                raise recalled
            requests.append(_UnitRequest.of(recalled, prepared, answerer))
        except (DataError, ModelError, UserCodeError) as error:
            yield unit.record_failure(session.describe_failure(unit, error), asked=_is_asked(error))
    waiting: list[_UnitRequest] = []
    for _, in_one_context in groupby(_in_order(requests), key=_names):
        waiting += in_one_context
        if not answerer.batch_contexts:
            yield from _answer_in_batches(waiting, answerer, session)
            waiting = []
    yield from _answer_in_batches(waiting, answerer, session)


def request_fingerprint(
    context: Sequence[Part], text: str, answers: Sequence[Answer], decoding: Mapping[str, Any]
) -> str:
    """Return the hash of a request: context with the frames' content, text, gold answers, decoding.

    Raises:
        DataError: a frame cannot be read.
    """
    contents = [_content(part) for part in context]
    return fingerprint(
        {"context": contents, "text": text, "answers": list(answers), "decoding": decoding}
    )


def _content(part: Part) -> Any:
    """Return a part as JSON values, frames by the digests of their content."""
    if isinstance(part, Video):
        return {"video": [frame.digest for frame in part.frames], "fps": part.fps}
    return [part.digest] if isinstance(part, FrameRef) else part


def _in_order(requests: Sequence[_UnitRequest]) -> list[_UnitRequest]:
    """Return requests by their contexts; of a pair, the other world's after the first one's."""
    worlds: dict[tuple[str, str, int], dict[str, list[str]]] = {}
    for request in requests:
        worlds.setdefault(_pair(request), {})[_world(request)] = _names(request)

    def place(request: _UnitRequest) -> tuple[list[str], bool, list[str]]:
        names = worlds[_pair(request)]
        first = first_world(names)
        return names[first], _world(request) != first, names[_world(request)]

    return sorted(requests, key=place)


def _pair(request: _UnitRequest) -> tuple[str, str, int]:
    """Return what the questions of a pair have in common; of another question what tells it."""
    key = request.unit.key
    return request.unit.sample.question.pair or key.id, key.variant, key.repeat


def _world(request: _UnitRequest) -> str:
    return request.unit.sample.question.traj_id


def _names(request: _UnitRequest) -> list[str]:
    return [name for part in request.context for name in _names_in(part)]


def _names_in(part: Part) -> list[str]:
    if isinstance(part, Video):
        return [f"video of {part.fps} fps", *(frame.name for frame in part.frames)]
    return [part.name if isinstance(part, FrameRef) else part]


def _recall_all(
    units: Sequence[NiehUnit],
    prepared: PreparedTask,
    answerer: OpenAnswerer,
    session: Session[NiehAnswer],
) -> list[tuple[NiehUnit, NiehUnit | Exception]]:
    """Return each unit with what its memory recalled, or why that failed; or as it is."""
    if answerer.write is None or not any(unit.sample.awaits_recall for unit in units):
        return [(unit, unit) for unit in units]
    recaller = Recaller(
        prepared.task_samples,
        answerer.write,
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
    sample = apply_recall(unit.sample, recall)
    payload = replace_fields(
        unit.payload,
        recall=recall,
        shown_clues=shown_clues(prepared.task_samples, sample),
        twin=twin_side(prepared.task_samples, sample),
    )
    return replace(unit, sample=sample, payload=payload)


def _answer_in_batches(
    requests: Sequence[_UnitRequest], answerer: OpenAnswerer, session: Session[NiehAnswer]
) -> Iterator[UnitRecord[NiehAnswer]]:
    # A batch has the same requests when a run is resumed, as replies can differ by rounding with
    # those beside them.
    for batch in _batches(requests, answerer.batch_size):
        waiting = []
        for request in batch:
            record = _find_record(request, session)
            if record is None:
                waiting.append(request)
            else:
                yield record
        if waiting:
            yield from _answer(waiting, answerer, session)


def _batches(requests: Sequence[_UnitRequest], size: int) -> Iterator[Sequence[_UnitRequest]]:
    """Yield batches of requests with one decoding: all first requests, then all second ones."""
    for repeat in sorted({request.unit.key.repeat for request in requests}):
        same = [request for request in requests if request.unit.key.repeat == repeat]
        yield from (same[at : at + size] for at in range(0, len(same), size))


def _find_record(
    request: _UnitRequest, session: Session[NiehAnswer]
) -> UnitRecord[NiehAnswer] | None:
    """Return the record of a unit without asking: an earlier run's, or of an unreadable frame."""
    try:
        return session.find_record(request.unit, request.fingerprint)
    except DataError as error:
        return request.unit.record_failure(session.describe_failure(request.unit, error))


def _answer(
    requests: Sequence[_UnitRequest],
    answerer: OpenAnswerer,
    session: Session[NiehAnswer],
    faults: tuple[str, ...] = (),
) -> Iterator[UnitRecord[NiehAnswer]]:
    start = time.perf_counter()
    try:
        replies = answerer.answer(requests)
    except (DataError, ModelError) as error:
        if len(requests) == 1:
            (request,) = requests
            yield request.unit.record_failure(
                session.describe_failure(request.unit, error),
                request.fingerprint,
                asked=_is_asked(error),
                faults=faults,
            )
            return
        for request in requests:  # one of them may be to blame; the others are answered
            yield from _answer(
                [request], answerer, session, (f"asked with {len(requests) - 1} others: {error}",)
            )
        return
    seconds = (time.perf_counter() - start) / len(requests)
    for request, reply in zip(requests, replies, strict=True):
        took = seconds if reply.seconds is None else reply.seconds
        yield request.record(reply, took, faults, answerer.usage(reply), session)


def _is_asked(error: Exception) -> bool:
    return not isinstance(error, NotAskedError)
