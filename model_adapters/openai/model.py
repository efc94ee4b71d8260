"""A model behind a server as a `Model`."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.openai.completions import Completion, TokenUsage, read_completion
from model_adapters.openai.endpoint import Endpoint
from model_adapters.openai.messages import EncodedFrames, to_messages
from model_adapters.openai.options import OpenAIOptions
from model_adapters.openai.secret import Secret
from model_adapters.openai.spend import Caps, Charge, Prices, RateLimiter, Spend
from model_adapters.protocols import Capabilities, Conversation, Decoding, Reply, Turn
from model_adapters.thinking import cut_at_stop

__all__ = ["ServedModel"]

_MOST_STOPS = 4  # stop strings that servers accept
_SEEDS = 2**31  # servers accept seeds of few more bits


class ServedModel:
    """A model behind a server. Every request has the whole conversation; the server may cache
    common prefixes."""

    def __init__(self, name: str, options: OpenAIOptions, secret: Secret) -> None:
        self.name = name
        self._options = options
        self._secret = secret
        self._endpoint = Endpoint(options, secret)
        self._frames = EncodedFrames(options.image_format)
        self._spend = Spend(name, Caps(options.max_tokens_total, options.max_cost))
        self._prices = _prices(options)
        self._token_limiter = RateLimiter(options.tokens_per_minute)
        self._expected_tokens = 0  # of a request with its reply, estimated by the previous one

    @property
    def capabilities(self) -> Capabilities:
        """No guarantees beyond sampling: the server is unknown."""
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
        """Return address, model and form of requests, as JSON values; the weights behind the
        address are unknown."""
        return {"adapter": self.name} | self._options.document()

    def tokens_per_frame(self, frame: FrameRef) -> None:
        """Return None: only the server counts, and only sent requests."""

    def conversation(self) -> Conversation:
        """Return a new, empty conversation."""
        return BackendConversation(self)

    def count(self, turns: Sequence[Turn]) -> None:
        """Return None, as `tokens_per_frame`."""

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        request = self._request(turns, decoding)
        with self._spend.request() as charge:
            completion, faults = self._send(request, charge)
        text = self._secret.redact(completion.text(self._endpoint.where))
        thinking = None if completion.thinking is None else self._secret.redact(completion.thinking)
        reply = Reply(self._cut(text, decoding), faults=faults, thinking=thinking)
        usage = completion.usage
        if usage is None:
            return reply
        return replace(
            reply,
            n_reply_tokens=usage.completion_tokens,
            n_context_tokens=usage.prompt_tokens,
            n_cached_tokens=usage.n_cached,
            cost=self._cost(usage),
        )

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer one after the other, because answers before a failure are paid for; see
        `Conversation.replies`."""
        return [self.answer(turns, decoding) for turns in conversations]

    def close(self) -> None:
        """Close all connections."""
        self._endpoint.close()

    def _request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        options = self._options
        request: dict[str, Any] = {
            "model": options.model,
            "messages": to_messages(self.name, turns, self._frames, options.detail),
            options.max_tokens_field: decoding.max_new_tokens,
        }
        if options.send_temperature:
            request["temperature"] = decoding.temperature
            if not decoding.greedy:
                request["top_p"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            request["seed"] = decoding.seed % _SEEDS
        extra: dict[str, Any] = {}  # what is not in OpenAI's own interface
        if options.send_repetition_penalty and decoding.repetition_penalty is not None:
            extra["repetition_penalty"] = decoding.repetition_penalty
        if decoding.choices:
            extra["structured_outputs"] = {"choice": list(decoding.choices)}
        if not decoding.choices and options.send_stop and decoding.stop:
            request["stop"] = list(decoding.stop[:_MOST_STOPS])
            if options.send_skip_special_tokens:
                extra["skip_special_tokens"] = False
        if extra:
            request["extra_body"] = extra
        return request

    def _send(self, request: dict[str, Any], charge: Charge) -> tuple[Completion, tuple[str, ...]]:
        # The tokens of a request are known only afterwards: an estimate is taken first and
        # corrected then.
        expected = used = self._expected_tokens
        self._token_limiter.wait(expected)
        try:
            content, faults = self._endpoint.ask(request)
            charge.sent = True
            completion = read_completion(self._endpoint.where, content)
            if completion.usage is not None:
                self._expected_tokens = used = charge.tokens = completion.usage.total
                charge.cost = self._cost(completion.usage) or 0.0
        finally:
            self._token_limiter.take(used - expected)
        return completion, faults

    def _cost(self, usage: TokenUsage) -> float | None:
        if self._prices is None:
            return None
        return self._prices.cost(usage.prompt_tokens, usage.n_cached or 0, usage.completion_tokens)

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


def _prices(options: OpenAIOptions) -> Prices | None:
    prompt = options.price_per_m_input
    reply = options.price_per_m_output
    if prompt is None or reply is None:
        return None
    cached = options.price_per_m_cached
    return Prices(prompt, prompt if cached is None else cached, reply)
