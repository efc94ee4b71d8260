"""A model behind a server as a `Model`, and the protocol of the dialect that the server speaks.

To add a dialect: a module here, as `openai.py`; its options in `options.py`, its adapter in
`adapters.py`, its line in `model_adapters/built_in.py`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import msgspec

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import Video
from infthor_eval.storage.digests import SIZE, canonical_json, digest
from model_adapters.backend import UncountedBackend
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn
from model_adapters.served.batches.queue import BatchQueue, BatchRules
from model_adapters.served.batches.service import BatchReply, BatchService
from model_adapters.served.completion import Completion, TokenUsage
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.options import ServedOptions
from model_adapters.served.secret import Secret
from model_adapters.served.spend import Caps, Charge, Prices, RateLimiter, Spend
from model_adapters.served.wire import Call, StatusError
from model_adapters.thinking import cut_at_stop

_JSON = {"Content-Type": "application/json"}


class Dialect(Protocol):
    """How requests to a server and its replies are written.

    Attributes:
        path: path of requests, below the server's address.
        hint: how to fix a request that is refused.
        guides: true if replies can be restricted to choices.
    """

    path: str
    hint: str
    guides: bool

    def headers(self, key: str | None) -> Mapping[str, str]:
        """Return the headers of every request; `key` is the API key, if there is one."""

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """Return a request as JSON values.

        Raises:
            DataError: a frame cannot be read.
            ModelError: the server does not take these turns.
        """

    def read(self, where: str, content: bytes) -> Completion:
        """Parse the reply of the server that `where` names.

        Raises:
            ModelError: it is no reply of this dialect.
        """

    def batch_service(self, endpoint: Endpoint) -> BatchService:
        """Return the part of the server that takes batches."""


class ServedModel(UncountedBackend):
    """A model behind a server. Every request has the whole conversation; the server may cache
    common prefixes."""

    def __init__(self, name: str, options: ServedOptions, secret: Secret, dialect: Dialect) -> None:
        self.name = name
        self._options = options
        self._secret = secret
        self._dialect = dialect
        self._endpoint = Endpoint(options, secret, dialect.headers(secret.value), dialect.hint)
        self._spend = Spend(name, Caps(options.max_tokens_total, options.max_cost))
        self._prices = Prices.of(options)
        self._token_limiter = RateLimiter(options.tokens_per_minute)
        self._expected_tokens = 0  # of a request with its reply, estimated by the previous one
        self._queue: BatchQueue | None = None

    @property
    def capabilities(self) -> Capabilities:
        """No guarantees beyond sampling: the server is unknown."""
        return Capabilities(
            counts_tokens=False,
            token_ids=False,
            deterministic=False,
            sampling=True,
            choices=self._dialect.guides,
            max_in_flight=self._options.max_in_flight,
        )

    @property
    def uses_batches(self) -> bool:
        """See `BatchModel`."""
        return self._options.batch

    def identity(self) -> dict[str, Any]:
        """Return address, model and form of requests, as JSON values; the weights behind the
        address are unknown."""
        return {"adapter": self.name} | self._options.document()

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        if self._queue is not None:
            raise ModelError(
                f"{self.name} is asked in batches, and this needs a reply at once; leave out batch"
            )
        request = self._dialect.request(turns, decoding)
        with self._spend.request() as charge:
            completion, faults = self._send(request, charge)
        return self._reply(completion, decoding, faults)

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer one after the other, because answers before a failure are paid for; see
        `Conversation.replies`."""
        if self._queue is None:
            return super().answer_each(conversations, decoding)
        return [self._answer_in_batch(self._queue, turns, decoding) for turns in conversations]

    def open_batches(
        self, folder: Path, notify: Callable[[str], None], should_stop: Callable[[], bool]
    ) -> BatchQueue:
        """See `BatchModel`."""
        rules = BatchRules(
            most_requests=self._options.batch_requests,
            most_mb=self._options.batch_mb,
            retries=self._options.retries,
            room=self._spend.room,
            count=self._count,
            failure=self._failure,
            describe=self._endpoint.describe,
            redact=self._secret.redact,
            where=self._endpoint.where,
        )
        service = self._dialect.batch_service(self._endpoint)
        self._queue = BatchQueue(folder, service, rules, notify, should_stop)
        return self._queue

    def close(self) -> None:
        """Close all connections."""
        if self._queue is not None:
            self._queue.close()
        self._endpoint.close()

    def _answer_in_batch(
        self, queue: BatchQueue, turns: Sequence[Turn], decoding: Decoding
    ) -> Reply:
        given = queue.ask(
            self._hash(turns, decoding), lambda: self._dialect.request(turns, decoding)
        )
        completion = self._dialect.read(self._endpoint.where, given.content)
        reply = self._reply(completion, decoding, given.faults)
        if not given.is_shared:
            return reply
        # Equal requests are asked once: the later ones cost nothing, and encode nothing anew.
        free = None if reply.cost is None else 0.0
        return replace(reply, n_cached_tokens=reply.n_context_tokens, cost=free)

    def _hash(self, turns: Sequence[Turn], decoding: Decoding) -> str:
        """Return the name of a request in batches: a hash of all that it asks."""
        said = [[turn.role, *map(_content, turn.parts)] for turn in turns]
        document = {"turns": said, "decoding": decoding.document()} | self._options.document()
        return digest(canonical_json(document), SIZE)

    def _count(self, reply: BatchReply) -> None:
        """Count a reply that came in a batch for the caps."""
        charge = Charge(sent=True)
        try:
            usage = self._dialect.read(self._endpoint.where, reply.content.encode()).tokens
        except ModelError:  # told where the reply is used
            usage = None
        self._note(usage, charge)
        self._spend.add(charge)

    def _send(self, request: dict[str, Any], charge: Charge) -> tuple[Completion, tuple[str, ...]]:
        # The tokens of a request are known only afterwards: an estimate is taken first and
        # corrected then.
        expected = used = self._expected_tokens
        self._token_limiter.wait(expected)
        try:
            call = Call(
                path=self._dialect.path,
                content=msgspec.json.encode(request),
                headers=_JSON,
                failure=self._failure,
            )
            answer, faults = self._endpoint.ask(call)
            charge.sent = True
            completion = self._dialect.read(self._endpoint.where, answer.content)
            self._note(completion.tokens, charge)
            if completion.tokens is not None:
                self._expected_tokens = used = completion.tokens.total
        finally:
            self._token_limiter.take(used - expected)
        return completion, faults

    def _failure(self, content: bytes) -> StatusError | None:
        try:
            completion = self._dialect.read("it", content)
            if completion.failure is None:
                completion.text("it")
            return completion.failure
        except ModelError as error:  # no reply, or one without a text
            return StatusError(0, str(error).encode(), {})

    def _reply(self, completion: Completion, decoding: Decoding, faults: tuple[str, ...]) -> Reply:
        text = self._secret.redact(completion.text(self._endpoint.where))
        thinking = None if completion.thinking is None else self._secret.redact(completion.thinking)
        reply = Reply(self._cut(text, decoding), faults=faults, thinking=thinking)
        usage = completion.tokens
        if usage is None:
            return reply
        return replace(
            reply,
            n_reply_tokens=usage.completion_tokens,
            n_context_tokens=usage.prompt_tokens,
            n_cached_tokens=usage.n_cached,
            cost=self._cost(usage),
        )

    def _note(self, usage: TokenUsage | None, charge: Charge) -> None:
        """Put what a reply took into its charge, where the server says it."""
        if usage is not None:
            charge.tokens = usage.total
            charge.cost = self._cost(usage) or 0.0

    def _cost(self, usage: TokenUsage) -> float | None:
        return None if self._prices is None else self._prices.cost(usage)

    def _cut(self, text: str, decoding: Decoding) -> str:
        if not decoding.choices:
            before_stop = cut_at_stop(text, decoding.stop)
            return text if before_stop is None else before_stop
        if text not in decoding.choices:
            raise ModelError(
                f"{self._endpoint.where} answers {text[:40]!r}, which is none of the choices; it "
                "does not support structured_outputs: leave out guided"
            )
        return text


def _content(part: str | FrameRef | Video) -> Any:
    """Return a part as JSON values; frames by the digests of their content."""
    assert not isinstance(part, Video)  # `check_turns` refuses it
    return [part.digest] if isinstance(part, FrameRef) else part
