"""Anthropic's messages."""

from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.errors import ModelError
from model_adapters.protocols import Decoding, Turn
from model_adapters.served.anthropic.batches import AnthropicBatches
from model_adapters.served.anthropic.messages import Message, to_messages
from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.frames import EncodedFrames
from model_adapters.served.options import AnthropicOptions

_VERSION = "2023-06-01"
_HOTTEST = 1.0


class AnthropicDialect:
    """The dialect of Anthropic's messages; see `Dialect`."""

    path = "/messages"
    hint = "check model and the options of requests (send_temperature, send_stop, prompt_cache)"
    guides = False

    def __init__(self, name: str, options: AnthropicOptions) -> None:
        self._name = name
        self._options = options
        self._frames = EncodedFrames(options.image_format)

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {"anthropic-version": _VERSION} | ({} if key is None else {"x-api-key": key})

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`. There is neither a seed nor a penalty in this dialect."""
        options = self._options
        cache = {"type": "ephemeral"} if options.prompt_cache != "off" else None
        if cache is not None and options.prompt_cache != "5m":
            cache["ttl"] = options.prompt_cache
        request: dict[str, Any] = {
            "model": options.model,
            "max_tokens": decoding.max_new_tokens,
            **to_messages(self._name, turns, self._frames, cache),
        }
        if options.send_temperature:
            if decoding.temperature > _HOTTEST:
                raise ModelError(f"{self._name} takes temperatures up to {_HOTTEST:g}; lower it")
            request["temperature"] = decoding.temperature
            if not decoding.greedy and decoding.top_p < 1:
                request["top_p"] = decoding.top_p
        # Those of white space alone are refused.
        stop = [text for text in decoding.stop if text.strip()]
        if options.send_stop and stop:
            request["stop_sequences"] = stop
        return request

    def read(self, where: str, content: bytes) -> Message:
        """See `Dialect`."""
        return decode_reply(where, content, Message, "a message")

    def batch_service(self, endpoint: Endpoint) -> AnthropicBatches:
        """See `Dialect`."""
        return AnthropicBatches(endpoint)
