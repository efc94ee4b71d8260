"""The Gemini API."""

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from model_adapters.protocols import Decoding, Turn
from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.frames import EncodedFrames
from model_adapters.served.gemini.batches import GeminiBatches
from model_adapters.served.gemini.contents import GeneratedContent, to_contents
from model_adapters.served.options import GeminiOptions

_MOST_STOPS = 5  # stop strings that the server accepts
_SEEDS = 2**31


class GeminiDialect:
    """The dialect of the Gemini API; see `Dialect`."""

    hint = "check model and the options of requests (send_temperature, send_stop, send_seed)"
    guides = False

    def __init__(self, name: str, options: GeminiOptions) -> None:
        self._name = name
        self._options = options
        self._frames = EncodedFrames(options.image_format)
        self._model = quote(options.model.removeprefix("models/"), safe="")
        self.path = f"/models/{self._model}:generateContent"

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {} if key is None else {"x-goog-api-key": key}

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`. There is no penalty in this dialect."""
        options = self._options
        config: dict[str, Any] = {"maxOutputTokens": decoding.max_new_tokens}
        if options.send_temperature:
            config["temperature"] = decoding.temperature
            if not decoding.greedy:
                config["topP"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            config["seed"] = decoding.seed % _SEEDS
        if options.send_stop and decoding.stop:
            config["stopSequences"] = list(decoding.stop[:_MOST_STOPS])
        return to_contents(self._name, turns, self._frames) | {"generationConfig": config}

    def read(self, where: str, content: bytes) -> GeneratedContent:
        """See `Dialect`."""
        return decode_reply(where, content, GeneratedContent, "generated content")

    def batch_service(self, endpoint: Endpoint) -> GeminiBatches:
        """See `Dialect`."""
        return GeminiBatches(endpoint, self._model)
