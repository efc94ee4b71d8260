"""Having questions answered: by a model's conversation, or by a baseline.

This is the one way from a question to its record, whatever suite asks it, and whoever drives it:
our own run, or lm-eval as the host.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any, Generic, Protocol, TypeVar

from infthor_eval.errors import (
    STOPS,
    DataError,
    ModelError,
    NotAskedError,
    UserCodeError,
    describe_exception,
)
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.question import Answer
from infthor_eval.runs import (
    NOTHING,
    ReadHashes,
    Session,
    StoredRequest,
    Tokens,
    Unit,
    UnitRecord,
    Usage,
    keep_request,
)
from infthor_eval.runs.journals.records import Payload
from infthor_eval.storage.deadlines import limit_by
from infthor_eval.storage.digests import fingerprint
from infthor_eval.storage.limits import SCORER_SECONDS
from model_adapters import (
    Decoding,
    Model,
    Notice,
    Part,
    PersonModel,
    Reply,
    answer_of,
    cut_at_stop,
    wrap_request_errors,
)


class MetricError(UserCodeError, DataError):
    """A metrics function from elsewhere raised an exception, or its result lacks a metric."""


@contextmanager
def wrap_metric_errors(problem: str) -> Iterator[None]:
    """Turn any exception in a metrics function into a `MetricError` of one line, with its place.

    Args:
        problem: the function and the question that it fails on.
    """
    try:
        with limit_by(SCORER_SECONDS, problem, MetricError):
            yield
    except (MetricError, *STOPS):
        raise
    except BaseException as error:  # it is anybody's code, and may call `sys.exit`
        raise MetricError(f"{problem}: {describe_exception(error)}") from error


@dataclass(frozen=True)
class Request(Generic[Payload]):
    """A unit with what is asked; a suite's own one says what comes of the reply.

    Attributes:
        context: what the model sees before the text.
        text: the text with the question.
        answers: the gold answers.
        decoding: how the reply is decoded.
        stop: strings that end an answer behind thoughts; the decoding's own would end the thoughts.
    """

    unit: Unit[Payload]
    context: tuple[Part, ...]
    text: str
    answers: Sequence[Answer]
    decoding: Decoding
    stop: tuple[str, ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """Words from which a person's typing is completed."""
        return ()

    def replied(self, reply: Reply, answer: str, thinking: str | None) -> Payload:
        """Return the payload with a reply, its answer and the thoughts before that, unscored."""
        raise NotImplementedError

    def scored(self, payload: Payload, answer: str) -> Payload:
        """Return a payload with the scores of the answer."""
        raise NotImplementedError

    @property
    def stored(self) -> StoredRequest | None:
        """The request as the journal has it; None for a baseline that is sent none."""
        raise NotImplementedError

    @cached_property
    def fingerprint(self) -> str:
        """See `request_fingerprint`."""
        return request_fingerprint(self.context, self.text, self.answers, self.decoding.document())

    @cached_property
    def names(self) -> list[str]:
        """The parts of the context by their names: who has the same ones shares the context."""
        return [name for part in self.context for name in _names_in(part)]

    def record(
        self,
        reply: Reply,
        seconds: float,
        faults: tuple[str, ...],
        usage: Usage,
        session: Session[Payload],
    ) -> UnitRecord[Payload]:
        """Return the record of a reply; failed, with the reply, if the metrics fail on it."""
        thinking, answer = answer_of(reply)
        before = cut_at_stop(answer, self.stop)
        answer = answer if before is None else before
        payload = self.replied(reply, answer, thinking)
        failure = None
        try:
            payload = self.scored(payload, answer)
        except MetricError as error:
            failure = session.describe_failure(self.unit, error)
        return self.unit.record(
            self.fingerprint,
            payload,
            failure=failure,
            faults=(*faults, *reply.faults),
            seconds=round(seconds, 4),
            tokens=Tokens(reply.n_context_tokens, reply.n_cached_tokens, reply.n_reply_tokens),
            usage=usage,
            read=ReadHashes(reply.context_hash, reply.frames_hash),
            request=keep_request(self.stored, session),
        )


Asked = TypeVar("Asked", bound=Request[Any])


class Replier(Protocol):
    """Gives the replies to requests of one group of units."""

    @property
    def batch_size(self) -> int:
        """Number of requests worth answering at once."""

    @property
    def batch_contexts(self) -> bool:
        """True if these may have different contexts."""

    def answer(self, requests: Sequence[Any]) -> list[Reply]:
        """Return replies to requests of one decoding, and of one context unless contexts are
        batched.

        Raises:
            DataError: a frame cannot be read; nothing is answered then.
            ModelError: the model cannot take one of the requests; nothing is answered then.
        """

    def usage(self, reply: Reply) -> Usage:
        """Return the usage of a reply."""


class ModelReplier:
    """A model with one conversation: requests in the same context, or in beginnings of one, share
    what is encoded of it."""

    def __init__(self, model: Model) -> None:
        self.batch_size = model.capabilities.batch_size
        self.batch_contexts = model.capabilities.batch_contexts
        self._name = model.name
        self._person = model if isinstance(model, PersonModel) else None
        self._conversation = model.conversation()
        self._start = self._conversation.mark()
        self._after_context = self._start
        self._context: tuple[Part, ...] | None = None

    def answer(self, requests: Sequence[Request[Any]]) -> list[Reply]:
        """See `Replier`."""
        context = requests[0].context
        decoding = requests[0].decoding
        if self._person is not None:
            self._person.show_notice(
                Notice(title="Question", unit="question", words=requests[0].words)
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
        """See `Replier`."""
        return Usage.of([reply])


class BaselineReplier(Generic[Asked]):
    """A baseline, which has no memory."""

    batch_size = 1
    batch_contexts = False

    def __init__(self, predict: Callable[[Asked], str]) -> None:
        """Take a function of a request."""
        self._predict = predict

    def answer(self, requests: Sequence[Asked]) -> list[Reply]:
        """See `Replier`."""
        return [Reply(self._predict(request)) for request in requests]

    def usage(self, reply: Reply) -> Usage:
        """See `Replier`."""
        return NOTHING


def answer_requests(
    requests: Sequence[Request[Payload]], replier: Replier, session: Session[Payload]
) -> Iterator[UnitRecord[Payload]]:
    """Yield the records of requests, in an order that depends on them alone.

    Neighbours in one context are answered together, or in contexts each of which begins the next
    one; and all of them if the replier batches contexts.
    """
    waiting: list[Request[Payload]] = []
    for request in requests:
        last = waiting[-1].names if waiting else []
        if request.names[: len(last)] != last and not replier.batch_contexts:
            yield from _answer_in_batches(waiting, replier, session)
            waiting = []
        waiting.append(request)
    yield from _answer_in_batches(waiting, replier, session)


def request_fingerprint(
    context: Sequence[Part], text: str, answers: Sequence[Answer], decoding: Mapping[str, Any]
) -> str:
    """Return the hash of a request: context with the frames' content, text, gold answers,
    decoding."""
    contents = [_content(part) for part in context]
    return fingerprint(
        {"context": contents, "text": text, "answers": list(answers), "decoding": decoding}
    )


def is_asked(error: Exception) -> bool:
    """Return False for an error which says that the subject was not asked, by the user's wish."""
    return not isinstance(error, NotAskedError)


def _content(part: Part) -> Any:
    """Return a part as JSON values, frames by the digests of their content."""
    if isinstance(part, Video):
        return {"video": [frame.digest for frame in part.frames], "fps": part.fps}
    return [part.digest] if isinstance(part, FrameRef) else part


def _names_in(part: Part) -> list[str]:
    if isinstance(part, Video):
        return [f"video of {part.fps} fps", *(frame.name for frame in part.frames)]
    return [part.name if isinstance(part, FrameRef) else part]


def _answer_in_batches(
    requests: Sequence[Request[Payload]], replier: Replier, session: Session[Payload]
) -> Iterator[UnitRecord[Payload]]:
    # A batch has the same requests when a run is resumed, as replies can differ by rounding with
    # those beside them.
    for batch in _batches(requests, replier.batch_size):
        waiting = []
        for request in batch:
            record = _find_record(request, session)
            if record is None:
                waiting.append(request)
            else:
                yield record
        if waiting:
            yield from _answer(waiting, replier, session)


def _batches(
    requests: Sequence[Request[Payload]], size: int
) -> Iterator[Sequence[Request[Payload]]]:
    """Yield batches of requests with one decoding: all first requests, then all second ones."""
    for repeat in sorted({request.unit.key.repeat for request in requests}):
        same = [request for request in requests if request.unit.key.repeat == repeat]
        for _, group in groupby(same, key=lambda request: request.decoding):
            alike = list(group)
            yield from (alike[at : at + size] for at in range(0, len(alike), size))


def _find_record(
    request: Request[Payload], session: Session[Payload]
) -> UnitRecord[Payload] | None:
    """Return the record of a unit without asking: an earlier run's, or of an unreadable frame."""
    try:
        return session.find_record(request.unit, request.fingerprint)
    except DataError as error:
        return request.unit.record_failure(session.describe_failure(request.unit, error))


def _answer(
    requests: Sequence[Request[Payload]],
    replier: Replier,
    session: Session[Payload],
    faults: tuple[str, ...] = (),
) -> Iterator[UnitRecord[Payload]]:
    start = time.perf_counter()
    try:
        replies = replier.answer(requests)
    except (DataError, ModelError) as error:
        if len(requests) == 1:
            (request,) = requests
            yield request.unit.record_failure(
                session.describe_failure(request.unit, error),
                request.fingerprint,
                asked=is_asked(error),
                faults=faults,
                request=keep_request(request.stored, session),
            )
            return
        for request in requests:  # one of them may be to blame; the others are answered
            yield from _answer(
                [request], replier, session, (f"asked with {len(requests) - 1} others: {error}",)
            )
        return
    seconds = (time.perf_counter() - start) / len(requests)
    for request, reply in zip(requests, replies, strict=True):
        took = seconds if reply.seconds is None else reply.seconds
        yield request.record(reply, took, faults, replier.usage(reply), session)
