"""Options of models behind a server: address, form of requests, rate limits, spend caps, batches.

To add an option of served models: a field here, in `in_identity` if it can change a reply; its
effect in `model.py` or `endpoint.py`, or, of one dialect alone, in its module.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from model_adapters.addresses import is_local, server_address

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_RANGES = {
    "max_in_flight": (1, 256),
    "retries": (0, 20),
    "timeout_s": (0.01, 86_400),
    "batch_requests": (1, 1_000_000),
    "batch_mb": (1, 2_000),
}
_ABOVE_ZERO = ("requests_per_minute", "tokens_per_minute", "max_tokens_total", "max_cost")
_PRICES = (
    "price_per_m_input",
    "price_per_m_cached",
    "price_per_m_cache_write",
    "price_per_m_output",
)

# Only requests of agents have these: what others ask is the same whatever they are, so that the
# document names them only where they are not at their default.
_OF_AGENTS = ("send_repetition_penalty", "send_skip_special_tokens")


@dataclass(frozen=True, kw_only=True)
class ServedOptions:
    """Options of requests to a server.

    Attributes:
        model: the server's name of the model.
        base_url: address of the server.
        api_key_env: name of the environment variable with the key; the key itself is never an
            option.
        insecure: allow requests to another machine without encryption.
        image_format: encoding of frames: png is lossless, jpeg (quality 95) is smaller.
        send_temperature: send temperature and top_p; some models refuse them and decode in their
            own way.
        send_stop: send stop strings, as many as the server takes; replies are cut here in any case.
        max_in_flight: requests at the same time.
        timeout_s: limit for a whole reply, from the connection to its last byte, in seconds.
        retries: repetitions of a request after transient failures.
        requests_per_minute: rate limit, kept evenly; None for none.
        tokens_per_minute: rate limit of the tokens of requests and replies, kept evenly; None for
            none.
        price_per_m_input: US dollars per million tokens of requests.
        price_per_m_cached: US dollars per million cached tokens of requests; as the others where
            None.
        price_per_m_cache_write: US dollars per million tokens that a request put into the cache;
            as the others where None.
        price_per_m_output: US dollars per million tokens of replies.
        max_tokens_total: cap on the tokens of a run; no request is sent once it is reached.
        max_cost: cap on the cost of a run in US dollars; no request is sent once it is reached.
        batch: ask in batches, at the price of batches; the replies come within a day.
        batch_requests: most requests of a batch; None for the most that the server takes.
        batch_mb: most megabytes of a batch; None for the most that the server takes.
    """

    model: str = ""
    base_url: str = ""
    api_key_env: str = ""
    insecure: bool = False
    image_format: str = "png"
    send_temperature: bool = True
    send_stop: bool = True
    max_in_flight: int = 4
    timeout_s: float = 300.0
    retries: int = 4
    requests_per_minute: float | None = None
    tokens_per_minute: float | None = None
    price_per_m_input: float | None = None
    price_per_m_cached: float | None = None
    price_per_m_cache_write: float | None = None
    price_per_m_output: float | None = None
    max_tokens_total: int | None = None
    max_cost: float | None = None
    batch: bool = False
    batch_requests: int | None = None
    batch_mb: int | None = None

    # Values of options that are names, by option; and options that can change a reply.
    one_of: ClassVar[Mapping[str, tuple[str | None, ...]]] = {"image_format": ("png", "jpeg")}
    in_identity: ClassVar[tuple[str, ...]] = (
        "model",
        "image_format",
        "send_temperature",
        "send_stop",
    )

    def __post_init__(self) -> None:
        """Raise `ValueError` for a value that is not valid; the message names the option and
        repeats no secret."""
        if not self.model:
            raise ValueError("it needs model=..., the server's name of the model")
        if not _NAME.fullmatch(self.api_key_env):
            raise ValueError(
                "api_key_env is not the name of an environment variable; put the key into one"
            )
        self._check_address()
        self._check_values()
        self._check_money()

    @property
    def url(self) -> str:
        """The address without a slash at its end."""
        return self.base_url.rstrip("/")

    def document(self) -> dict[str, Any]:
        """Return everything that can change a reply, as JSON values; rates and prices cannot, nor
        whether it is asked in a batch."""
        return {"base_url": self.url} | {name: getattr(self, name) for name in self.in_identity}

    def _check_address(self) -> None:
        address = server_address("base_url", self.base_url)
        if address.scheme == "http" and not (is_local(address) or self.insecure):
            raise ValueError(
                f"base_url leads to {address.hostname} without encryption, readable by everyone in "
                "between; use https, or set insecure=true"
            )

    def _check_values(self) -> None:
        for name, allowed in self.one_of.items():
            if getattr(self, name) not in allowed:
                known = " or ".join(value for value in allowed if value is not None)
                raise ValueError(f"{name}={getattr(self, name)} is not {known}")
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise ValueError(f"{name}={value} is not from {least:,} to {most:,}")
        for name in _ABOVE_ZERO:
            if getattr(self, name) is not None and not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} is not above 0")
        for name in ("batch_requests", "batch_mb"):
            if getattr(self, name) is not None and not self.batch:
                raise ValueError(f"{name} is for batches; give batch=true, too")

    def _check_money(self) -> None:
        for name in _PRICES:
            if getattr(self, name) is not None and not getattr(self, name) >= 0:
                raise ValueError(f"{name}={getattr(self, name)} is below 0")
        needed = (self.price_per_m_input, self.price_per_m_output)
        money_options = [name for name in ("max_cost", *_PRICES) if getattr(self, name) is not None]
        if money_options and None in needed:
            raise ValueError(
                f"{money_options[0]} needs price_per_m_input and price_per_m_output; give both"
            )


@dataclass(frozen=True, kw_only=True)
class OpenAIOptions(ServedOptions):
    """Options of requests to a server of OpenAI's chat completions, beside `ServedOptions`.

    Attributes:
        base_url: address of the server without `/chat/completions`.
        detail: value of `detail` for every frame; not sent where None.
        max_tokens_field: name of the field that limits the reply.
        send_seed: send the seed of sampled replies.
        send_repetition_penalty: send the penalty of requests that have one, as agents' have; OpenAI
            itself refuses it.
        send_skip_special_tokens: send `skip_special_tokens: false` with stop strings, as agents
            have: else vLLM and SGLang strip `<|act|>` from the text before they look for it. OpenAI
            itself refuses it.
        guided: method that restricts replies to choices: `vllm` sends its `structured_outputs`;
            None for no support.
        send_prompt_cache_key: send a hash of the frames as `prompt_cache_key`, so that requests on
            the same frames reach the same cache.
    """

    base_url: str = "https://api.openai.com/v1"
    api_key_env: str = "OPENAI_API_KEY"
    detail: str | None = None
    max_tokens_field: str = "max_tokens"
    send_seed: bool = True
    send_repetition_penalty: bool = True
    send_skip_special_tokens: bool = True
    guided: str | None = None
    send_prompt_cache_key: bool = False

    one_of: ClassVar[Mapping[str, tuple[str | None, ...]]] = {
        **ServedOptions.one_of,
        "detail": (None, "auto", "low", "high"),
        "max_tokens_field": ("max_tokens", "max_completion_tokens"),
        "guided": (None, "vllm"),
    }
    in_identity: ClassVar[tuple[str, ...]] = (
        *ServedOptions.in_identity,
        "detail",
        "max_tokens_field",
        "send_seed",
        "guided",
    )

    def document(self) -> dict[str, Any]:
        """See `ServedOptions`."""
        return super().document() | {name: False for name in _OF_AGENTS if not getattr(self, name)}


@dataclass(frozen=True, kw_only=True)
class AnthropicOptions(ServedOptions):
    """Options of requests to a server of Anthropic's messages, beside `ServedOptions`.

    Attributes:
        base_url: address of the server without `/messages`.
        prompt_cache: how long the server caches what is before the question, frames included: `5m`,
            `1h` or `off`. What is put into the cache has a price of its own.
    """

    base_url: str = "https://api.anthropic.com/v1"
    api_key_env: str = "ANTHROPIC_API_KEY"
    prompt_cache: str = "5m"

    one_of: ClassVar[Mapping[str, tuple[str | None, ...]]] = {
        **ServedOptions.one_of,
        "prompt_cache": ("5m", "1h", "off"),
    }


@dataclass(frozen=True, kw_only=True)
class GeminiOptions(ServedOptions):
    """Options of requests to a server of the Gemini API, beside `ServedOptions`.

    Attributes:
        base_url: address of the server without `/models`.
        send_seed: send the seed of sampled replies.
    """

    base_url: str = "https://generativelanguage.googleapis.com/v1beta"
    api_key_env: str = "GEMINI_API_KEY"
    send_seed: bool = True

    in_identity: ClassVar[tuple[str, ...]] = (*ServedOptions.in_identity, "send_seed")
