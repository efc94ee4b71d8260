"""OpenAI's chat completions: vLLM, SGLang, transformers, commercial servers."""

from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.digests import fingerprint
from model_adapters.protocols import Decoding, Turn
from model_adapters.served.completion import decode_reply
from model_adapters.served.endpoint import Endpoint
from model_adapters.served.frames import EncodedFrames
from model_adapters.served.openai.batches import OpenAIBatches
from model_adapters.served.openai.completions import ChatCompletion
from model_adapters.served.openai.messages import to_messages
from model_adapters.served.options import OpenAIOptions

_MOST_STOPS = 4  # stop strings that servers accept
_SEEDS = 2**31  # servers accept seeds of few more bits


class OpenAIDialect:
    """The dialect of OpenAI's chat completions; see `Dialect`."""

    path = "/chat/completions"
    hint = (
        "check model and the options of requests (send_seed, send_temperature, send_stop, "
        "send_repetition_penalty, send_skip_special_tokens, max_tokens_field)"
    )

    def __init__(self, name: str, options: OpenAIOptions) -> None:
        self._name = name
        self._options = options
        self.guides = options.guided is not None
        self._frames = EncodedFrames(options.image_format)

    def headers(self, key: str | None) -> Mapping[str, str]:
        """See `Dialect`."""
        return {} if key is None else {"Authorization": f"Bearer {key}"}

    def request(self, turns: Sequence[Turn], decoding: Decoding) -> dict[str, Any]:
        """See `Dialect`."""
        options = self._options
        request: dict[str, Any] = {
            "model": options.model,
            "messages": to_messages(self._name, turns, self._frames, options.detail),
            options.max_tokens_field: decoding.max_new_tokens,
        }
        if options.send_temperature:
            request["temperature"] = decoding.temperature
            if not decoding.greedy:
                request["top_p"] = decoding.top_p
        if options.send_seed and not decoding.greedy:
            request["seed"] = decoding.seed % _SEEDS
        if options.send_prompt_cache_key:
            request["prompt_cache_key"] = _hash_of_frames(turns)
        if options.send_repetition_penalty and decoding.repetition_penalty is not None:
            request["repetition_penalty"] = decoding.repetition_penalty
        if decoding.choices:
            request["structured_outputs"] = {"choice": list(decoding.choices)}
        elif options.send_stop and decoding.stop:
            request["stop"] = list(decoding.stop[:_MOST_STOPS])
            if options.send_skip_special_tokens:
                request["skip_special_tokens"] = False
        return request

    def read(self, where: str, content: bytes) -> ChatCompletion:
        """See `Dialect`."""
        return decode_reply(where, content, ChatCompletion, "a chat completion")

    def batch_service(self, endpoint: Endpoint) -> OpenAIBatches:
        """See `Dialect`."""
        return OpenAIBatches(endpoint)


def _hash_of_frames(turns: Sequence[Turn]) -> str:
    """Return a key that requests on the same frames have in common."""
    parts = [part for turn in turns for part in turn.parts if isinstance(part, FrameRef)]
    return fingerprint({"frames": [frame.digest for frame in parts]})
