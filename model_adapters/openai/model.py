"""A model behind a server, as the harness talks to it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.openai.completions import Completion, TokenUsage, read_completion
from model_adapters.openai.endpoint import Endpoint
from model_adapters.openai.messages import EncodedFrames, messages_of
from model_adapters.openai.options import OpenAIOptions
from model_adapters.openai.rate import RateLimiter
from model_adapters.openai.secret import Secret
from model_adapters.openai.spend import Caps, Charge, Prices, Spend
from model_adapters.protocols import Capabilities, Conversation, Decoding, Reply, Turn
from model_adapters.stopping import cut_at_stop

__all__ = ["ServedModel"]

_MOST_STOPS = 4  # that servers take
_SEEDS = 2**31  # servers take few bits more


class ServedModel:
    """A model behind a server. Every request holds the whole conversation; what it shares is the server's affair.

    Args:
        name: the registry's name.
        options: how it is asked.
        secret: the key.
    """

    def __init__(self, name: str, options: OpenAIOptions, secret: Secret) -> None:
        self.name = name
        self._options = options
        self._secret = secret
        self._endpoint = Endpoint(options, secret)
        self._frames = EncodedFrames(options.image_format)
        self._spend = Spend(name, Caps(options.max_tokens_total, options.max_cost))
        self._prices = _prices(options)
        self._tokens = RateLimiter(options.tokens_per_minute)
        self._usual_tokens = 0  # of a request and its reply: the last one's

    @property
    def capabilities(self) -> Capabilities:
        """Nothing is promised of a server that is not known."""
        options = self._options
        return Capabilities(
            counts_tokens=False,
            token_ids=False,
            deterministic=False,
            sampling=True,
            choices=options.guided is not None,
            max_in_flight=options.max_in_flight,
        )

    def identity(self) -> dict[str, Any]:
        """Address, model and how it is asked, as JSON values; what stands behind the address is not known."""
        return {"adapter": self.name} | self._options.document()

    def tokens_per_frame(self, frame: FrameRef) -> None:
        """None: the server counts, and only what it was sent."""

    def conversation(self) -> Conversation:
        """A new, empty conversation."""
        return BackendConversation(self)

    def count(self, turns: Sequence[Turn]) -> None:
        """None, as `tokens_per_frame`."""

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """See `Conversation.reply`."""
        request = self._request(turns, decoding)
        with self._spend.request() as charge:
            completion, faults = self._completion(request, charge)
        text = self._secret.hidden_in(completion.text(self._endpoint.where))
        reply, usage = Reply(self._held(text, decoding), faults=faults), completion.usage
        if usage is None:
            return reply
        return replace(
            reply,
            n_reply_tokens=usage.completion_tokens,
            n_context_tokens=usage.prompt_tokens,
            n_cached_tokens=usage.cached,
            cost=self._cost(usage),
        )

    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """See `Conversation.replies`: one after the other, for what is answered before one fails is paid for."""
        return [self.answer(turns, decoding) for turns in conversations]

    def close(self) -> None:
        """Close all connections."""
        self._endpoint.close()

    def _request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        options = self._options
        request: dict[str, Any] = {
            "model": options.model,
            "messages": messages_of(self.name, turns, self._frames, options.detail),
            options.max_tokens_field: decoding.max_new_tokens,
        }
        if options.send_temperature:
            request["temperature"] = decoding.temperature
            if not decoding.greedy:
                request["top_p"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            request["seed"] = decoding.seed % _SEEDS
        if decoding.choices:  # a stop string does not cut them
            request["extra_body"] = {"structured_outputs": {"choice": list(decoding.choices)}}
        elif options.send_stop and decoding.stop:
            request["stop"] = list(decoding.stop[:_MOST_STOPS])
        return request

    def _completion(self, request: dict[str, Any], charge: Charge) -> tuple[Completion, tuple[str, ...]]:
        expected = taken = self._usual_tokens
        self._tokens.wait(expected)
        try:
            content, faults = self._endpoint.ask(request)
            charge.sent = True
            completion = read_completion(self._endpoint.where, content)
            if completion.usage is not None:
                self._usual_tokens = taken = charge.tokens = completion.usage.total
                charge.cost = self._cost(completion.usage) or 0.0
        finally:
            self._tokens.take(taken - expected)
        return completion, faults

    def _cost(self, usage: TokenUsage) -> float | None:
        if self._prices is None:
            return None
        return self._prices.cost(usage.prompt_tokens, usage.cached or 0, usage.completion_tokens)

    def _held(self, text: str, decoding: Decoding) -> str:
        if not decoding.choices:
            before_stop = cut_at_stop(text, decoding.stop)
            return text if before_stop is None else before_stop
        if text not in decoding.choices:
            raise ModelError(
                f"{self._endpoint.where} answers {text[:40]!r}, which is none of the choices; "
                "it does not know structured_outputs: leave out guided"
            )
        return text


def _prices(options: OpenAIOptions) -> Prices | None:
    read, written = options.price_per_m_input, options.price_per_m_output
    if read is None or written is None:
        return None
    cached = options.price_per_m_cached
    return Prices(read, read if cached is None else cached, written)
